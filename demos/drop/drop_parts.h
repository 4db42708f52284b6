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
/// The parts of cullet that a world uses; each part includes the previous ones.
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

/// The options of the world with this part: its broad phase, narrow phase, with active edges unless it is Bullet's, and
/// update of the boxes.
///
/// @param scene       backend: the broad phase of all parts but stock
/// @param fixedNarrow use scene.narrow for every part
WorldSceneOptions optionsOf(DropPart part, const WorldSceneOptions& scene, bool fixedNarrow);

/// Title of the part's column, at most 16 characters; a broad phase that is not cullet's is named.
std::string titleOf(DropPart part, const NamedBroadphase& broadphase);
}  // namespace CULLET_PRECISION
}  // namespace cullet
