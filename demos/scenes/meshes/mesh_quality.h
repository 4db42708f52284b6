// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/meshes/mesh_world.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
enum class TrialKind : std::uint8_t
{
    Slide,  ///< bodies that lie on the mesh slide in all directions, without friction
    Shot    ///< bodies are shot down onto the mesh from about a metre above
};

/// Bodies that move over a mesh, where nothing but its inner edges can deflect them.
struct MeshTrial
{
    TrialKind kind = TrialKind::Slide;
    std::string shape = "box";
    std::string mesh = "flat";
    double speed = 5;  ///< at the start, m/s
    int bodies = 24;
    int steps = 120;
};

/// "slide" or "shot".
const char* trialName(TrialKind kind);

/// Ghost collisions of all shapes at 5 and 15 m/s, long boxes on small triangles, small bodies that tunnel at 6, 12 and
/// 24 m/s, and bodies that fall onto needles.
const std::vector<MeshTrial>& meshTrials();

/// A quantity of all bodies.
struct BodySummary
{
    double mean = 0, largest = 0;
};

struct MeshQuality
{
    BodySummary jump;      ///< largest upward speed of a body, m/s
    BodySummary slowdown;  ///< part of the horizontal speed that is lost at the end
    BodySummary spin;      ///< largest angular speed of a body, rad/s
    int jumped = 0;        ///< bodies that moved up by more than 0.1 m/s
    int fallen = 0;        ///< bodies below the mesh at the end
};

/// @param narrow one of narrowPhaseNames()
MeshQuality runTrial(const MeshTrial& trial, const std::string& narrow, std::uint64_t seed);
}  // namespace CULLET_PRECISION
}  // namespace cullet
