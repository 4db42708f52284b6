// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet::test
{
/// How many poses of each kind this process has checked, so that a test can see that all of them are drawn.
struct ContactShares
{
    std::uint64_t checks = 0;
    std::uint64_t apart = 0;     ///< beyond the reach of a query
    std::uint64_t near = 0;      ///< within it, cores more than their rounding apart
    std::uint64_t touching = 0;  ///< cores within 1e-4 of their size of touching
    std::uint64_t shallow = 0;   ///< cores overlap by less than a twentieth of their size
    std::uint64_t deep = 0;
    std::uint64_t bullets = 0;      ///< pairs that Bullet's own algorithm answers where they touch
    std::uint64_t unconverged = 0;  ///< polytopes that are left to Bullet, as no answer was found
    std::uint64_t flat = 0;         ///< a hull without volume is among them

    static ContactShares& get()
    {
        static ContactShares shares;
        return shares;
    }
};
}  // namespace cullet::test
