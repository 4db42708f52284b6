// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/world.h"

namespace cullet::preload
{
/// The StepParts of a stand-in, which stay at their address until the stand-in is destroyed.
world_layers::StepParts& stepPartsOf(const btCollisionWorld& world);

/// Frees the StepParts of a stand-in.
void endWorld(const btCollisionWorld& world);

/// Base whose StepParts are found by its address, since an object in the program's memory has the size of Base.
template <class Base>
class StepPartsBeside : public Base
{
public:
    using Base::Base;
    ~StepPartsBeside() override { endWorld(*this); }

protected:
    world_layers::StepParts& stepParts() { return stepPartsOf(*this); }
    const world_layers::StepParts& stepParts() const { return stepPartsOf(*this); }
};

/// A cullet::World in memory that the program has allocated for Bullet's type.
template <class Base>
using WorldStandIn = World<Base, StepPartsBeside>;
}  // namespace cullet::preload
