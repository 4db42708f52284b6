// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

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

    /// Writes the statistics to stderr, if the environment requires it.
    void (*summarise)();
};

inline constexpr const char* kImplementationName = "cullet_preload_implementation";
using GetImplementation = const Implementation* (*)();
}  // namespace cullet::preload
