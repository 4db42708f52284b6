// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

namespace cullet::preload
{
/// What the library of one precision does for the one that is preloaded, which knows no precision. No function throws.
struct Implementation
{
    /// Makes a stand-in for a btDbvtBroadphase.
    ///
    /// @param memory sizeof(btDbvtBroadphase) bytes of the program's
    /// @param cache  the btOverlappingPairCache of the program's, or null
    /// @param needsTrees the program may look into the public trees
    /// @return false: the memory is as it was, and Bullet's constructor has to run
    bool (*construct)(void* memory, void* cache, bool needsTrees);

    /// Registers ISA-GJK with a btCollisionDispatcher that Bullet's constructor has made.
    void (*adopt)(void* dispatcher);

    /// Says on stderr what happened so far, if the environment asks for it.
    void (*summarise)();
};

inline constexpr const char* kImplementationName = "cullet_preload_implementation";
using GetImplementation = const Implementation* (*)();
}  // namespace cullet::preload
