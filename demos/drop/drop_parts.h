// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"

#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What a world has of cullet; each part comes on top of those before it.
enum class DropPart
{
    Stock,       ///< Bullet with btDbvtBroadphase as shipped
    Broadphase,  ///< + cullet::Broadphase
    Dispatcher,  ///< + cullet::Dispatcher
    World        ///< + cullet::World
};

/// Names of the parts in their order: stock, broadphase, dispatcher, world.
const std::vector<std::string>& dropPartNames();

const std::string& nameOf(DropPart part);

/// The parts with these names, each once and in their own order.
///
/// @param names some of dropPartNames()
std::vector<DropPart> dropPartsNamed(const std::vector<std::string>& names);

/// The options of the world with this part: its broad phase, narrow phase and update of the boxes.
///
/// @param scene       backend: the broad phase of all parts but stock
/// @param fixedNarrow scene.narrow holds for every part
WorldSceneOptions optionsOf(DropPart part, const WorldSceneOptions& scene, bool fixedNarrow);

/// What stands above the part's column, at most 16 letters; the broad phase by its name where it is none of cullet's.
std::string titleOf(DropPart part, const NamedBroadphase& broadphase);
}  // namespace CULLET_PRECISION
}  // namespace cullet
