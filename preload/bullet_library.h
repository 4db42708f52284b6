// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/preload/bullet_functions.h"
#include "cullet/preload/implementation.h"

namespace cullet::preload
{
/// A library of this process that has Bullet's functions in it.
struct BulletLibrary
{
    const void* base = nullptr;  ///< where it is mapped
    void* functions[kFunctionCount] = {};
    const Implementation* implementation = nullptr;  ///< null: this Bullet is left as it is
    BulletLibrary* next = nullptr;
};

/// The Bullet that `caller` would have reached without the preloaded library: the first one of the process's global
/// scope, else the one that the caller's own library depends on. Finds it, and the implementation of its precision, when
/// it is first asked. Ends the process if there is none, since the caller cannot go on.
///
/// @param caller an address in the code of the caller
const BulletLibrary& libraryFor(const void* caller);

/// The same for calls about an object whose constructor has gone through libraryFor(): fast with one Bullet.
const BulletLibrary& knownLibraryFor(const void* caller);

/// The first one of all that libraryFor() has found; the others follow by `next`.
const BulletLibrary* knownLibraries();

/// Where the library or program that has this address in it is mapped.
const void* baseOf(const void* address);

/// CULLET_DISABLE is set, to something other than 0.
bool isDisabled();
}  // namespace cullet::preload
