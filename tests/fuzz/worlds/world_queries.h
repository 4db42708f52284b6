// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/worlds/world_twin.h"

namespace cullet::test
{
// Queries of a world, whose results become the twin's answers.

void castRay(WorldTwin& twin, const btVector3& from, const btVector3& to);
/// @param kind of the swept shape
void sweep(WorldTwin& twin, int kind, const btTransform& from, const btTransform& to);
void testContacts(WorldTwin& twin, std::size_t slot, btScalar distance);
void testContactsOfPair(WorldTwin& twin, std::size_t a, std::size_t b, btScalar distance);
/// Of the ghost in a slot, if there is one.
void queryGhost(WorldTwin& twin, std::size_t slot, const btVector3& from, const btVector3& to);
}  // namespace cullet::test
