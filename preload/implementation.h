// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/preload/dynamics_functions.h"

namespace cullet::preload
{
/// The functions of one precision's library for the preloaded library, which is independent of precision. None throws.
struct Implementation
{
    /// Creates a stand-in for a btDbvtBroadphase.
    ///
    /// @param memory sizeof(btDbvtBroadphase) bytes of the program
    /// @param cache  the program's btOverlappingPairCache, or null
    /// @param needsTrees the program may read the public trees
    /// @return false: the memory is unchanged, and Bullet's constructor must run
    bool (*construct)(void* memory, void* cache, bool needsTrees);

    /// Registers ISA-GJK with a btCollisionDispatcher after Bullet's constructor.
    void (*adopt)(void* dispatcher);

    /// Creates a stand-in for one of Bullet's worlds or its solver, if CULLET_WORLD or CULLET_SOLVER asks for it.
    ///
    /// @param memory    as many bytes of the program as Bullet's class has
    /// @param arguments of a world
    /// @return false: the memory is unchanged, and Bullet's constructor must run
    bool (*constructDynamics)(DynamicsClass kind, void* memory, const WorldArguments& arguments);

    /// Destroys such a stand-in.
    ///
    /// @param how DynamicsFunction::Delete: frees the memory too
    /// @return false: it is none, and Bullet's destructor must run
    bool (*destroyDynamics)(DynamicsClass kind, void* memory, DynamicsFunction how);

    /// Says once that something keeps Bullet's own world or solver, where another one was asked for.
    void (*keepDynamics)(DynamicsClass kind, const char* what);

    /// Writes the statistics to stderr, if the environment requires it.
    void (*summarise)();
};

inline constexpr const char* kImplementationName = "cullet_preload_implementation";
using GetImplementation = const Implementation* (*)();
}  // namespace cullet::preload
