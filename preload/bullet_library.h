// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/preload/bullet_functions.h"
#include "cullet/preload/implementation.h"

#include <atomic>

namespace cullet::preload
{
/// A library of this process that contains Bullet's functions.
struct BulletLibrary
{
    const void* base = nullptr;  ///< load address
    void* functions[kFunctionCount] = {};
    const Implementation* implementation = nullptr;  ///< null: this Bullet is not replaced
    void* implementationHandle = nullptr;            ///< of dlopen()
    BulletLibrary* next = nullptr;

    /// Functions of worlds and solvers, which are in another of Bullet's libraries; null until dynamicsFunction() has found them.
    mutable std::atomic<void*> dynamicsFunctions[kDynamicsClassCount][kDynamicsFunctionCount] = {};
};

/// The Bullet to which `caller` would be bound without the preloaded library: the first one in the process's global
/// scope, otherwise the one that the caller's own library depends on. The first call finds it, and the implementation
/// of its precision. Ends the process if there is none, since the caller cannot continue.
///
/// @param caller an address in the code of the caller
const BulletLibrary& libraryFor(const void* caller);

/// libraryFor() for calls on an object whose constructor has already called it; fast if there is one Bullet.
const BulletLibrary& knownLibraryFor(const void* caller);

/// A function of a world or solver of Bullet's, as the caller would be bound to it without the preloaded library.
void* dynamicsFunction(const BulletLibrary& bullet, DynamicsClass kind, DynamicsFunction function,
                       const void* caller);

/// Whether cullet may make the worlds or solvers that `caller` constructs. Says once why not.
bool ownsClass(const BulletLibrary& bullet, DynamicsClass kind, const void* caller);

/// The head of the list of all libraries that libraryFor() has found, linked by `next`.
const BulletLibrary* knownLibraries();

/// Load address of the library or program that contains an address.
const void* baseOf(const void* address);

/// Whether CULLET_DISABLE is set to something other than 0.
bool isDisabled();
}  // namespace cullet::preload
