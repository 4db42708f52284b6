// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/worlds/world_twin.h"

#include <memory>
#include <vector>

namespace cullet::test
{
/// The worlds of a run, of its first block.
struct WorldChoice
{
    WorldSettings settings;
    std::vector<std::unique_ptr<WorldTwin>> twins;
    /// Only what DBVT allows: no invalid boxes, and callbacks that neither throw nor change bodies.
    bool isTame = false;
    /// False with predictive manifolds, which refer to bodies until the step ends, and with Bullet's pair cache, which
    /// adds a pair after its filter without a look at its proxies.
    bool mayCallbacksDestroy = true;
    std::uint32_t bodies = 0;  ///< at the begin
    std::uint8_t noise = 0;
};

WorldChoice chosenWorlds(Choices& choices);

// Of a few bytes each; zeros are the plainest.
btVector3 chosenPlace(Choices& choices);  ///< six bytes
btQuaternion chosenTurn(Choices& choices);
BodyRecipe::Kind chosenKind(Choices& choices);
int chosenGroup(Choices& choices);
int chosenMask(Choices& choices);
ShapeRecipe chosenShape(Choices& choices, ShapeFamily family);
BodyRecipe chosenBody(Choices& choices, ShapeFamily family);
}  // namespace cullet::test
