// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btScalar.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How contacts behave.
enum class SolverModel : std::uint8_t
{
    Bullet,  ///< as with Bullet's solver and the same parameters
    Soft     ///< springs and dampers, solved in substeps: bodies come to rest
};

struct SolverOptions
{
    SolverModel model = SolverModel::Bullet;
    /// Upper limit for the threads; fewer are used for little work. 0: as many as the machine has. Results never depend
    /// on it.
    int threads = 0;

    /// @name SolverModel::Soft
    ///@{
    int substeps = 4;  ///< 1 to 64
    btScalar contactFrequency =
        30;  ///< of a contact between two bodies that move, 1 / s; twice that with one that does not
    btScalar contactDamping = 10;  ///< as a multiple of critical damping
    btScalar pushSpeed = 3;        ///< the most by which overlap separates bodies, m / s
    ///@}
};

}  // namespace CULLET_PRECISION
}  // namespace cullet
