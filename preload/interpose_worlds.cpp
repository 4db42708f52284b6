// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The constructors and destructors of Bullet's worlds that a program binds to this library first; see interpose.cpp. A
// function of a world that is called without its virtual table is Bullet's own: a cullet::World does the same, bit for
// bit.

#include "cullet/preload/bullet_library.h"
#include "cullet/preload/exported.h"

namespace
{
using cullet::preload::BulletLibrary;
using cullet::preload::WorldArguments;
using cullet::preload::WorldClass;
using cullet::preload::WorldFunction;

/// Worlds of Bullet's own classes that this thread is constructing. Their base classes are no classes of the program.
thread_local int t_constructing = 0;

void callConstructor(const BulletLibrary& bullet, WorldClass kind, WorldFunction function, const void* caller,
                     void* self, const WorldArguments& arguments)
{
    void* address = cullet::preload::worldFunction(bullet, kind, function, caller);
    ++t_constructing;
    reinterpret_cast<void (*)(void*, void*, void*, void*, void*)>(address)(
        self, arguments.dispatcher, arguments.broadphase, arguments.solver, arguments.configuration);
    --t_constructing;
}

void construct(WorldClass kind, const void* caller, void* self, const WorldArguments& arguments)
{
    const BulletLibrary& bullet = cullet::preload::libraryFor(caller);
    if (cullet::preload::ownsWorlds(bullet, caller))
    {
        if (bullet.implementation->constructWorld(kind, self, arguments))
            return;
    }
    callConstructor(bullet, kind, WorldFunction::Construct, caller, self, arguments);
}

void constructBase(WorldClass kind, const char* derived, const void* caller, void* self,
                   const WorldArguments& arguments)
{
    const BulletLibrary& bullet = cullet::preload::libraryFor(caller);
    const auto* own = bullet.implementation;
    // The stand-in derives from Bullet's class.
    if (own != nullptr && t_constructing == 0 &&
        cullet::preload::baseOf(caller) != cullet::preload::baseOf(own))
        own->keepWorld(derived);
    callConstructor(bullet, kind, WorldFunction::ConstructBase, caller, self, arguments);
}

void destroy(WorldClass kind, WorldFunction how, const void* caller, void* self)
{
    const BulletLibrary& bullet = cullet::preload::knownLibraryFor(caller);
    if (bullet.implementation != nullptr && bullet.implementation->destroyWorld(self, how))
        return;
    reinterpret_cast<void (*)(void*)>(cullet::preload::worldFunction(bullet, kind, how, caller))(self);
}
}  // namespace

// Defines the functions of one class.
#define CULLET_WORLD_FUNCTIONS(kind, symbol, arguments, derived)                                   \
    CULLET_EXPORT void cullet##kind##Construct(void* self, void* a, void* b, void* c,              \
                                               void* d) asm(symbol "C1" arguments);                \
    CULLET_EXPORT void cullet##kind##Construct(void* self, void* a, void* b, void* c, void* d)     \
    {                                                                                              \
        construct(WorldClass::kind, CULLET_CALLER, self, {a, b, c, d});                            \
    }                                                                                              \
    CULLET_EXPORT void cullet##kind##ConstructBase(void* self, void* a, void* b, void* c,          \
                                                   void* d) asm(symbol "C2" arguments);            \
    CULLET_EXPORT void cullet##kind##ConstructBase(void* self, void* a, void* b, void* c, void* d) \
    {                                                                                              \
        constructBase(WorldClass::kind, derived, CULLET_CALLER, self, {a, b, c, d});               \
    }                                                                                              \
    CULLET_EXPORT void cullet##kind##Delete(void* self) asm(symbol "D0Ev");                        \
    CULLET_EXPORT void cullet##kind##Delete(void* self)                                            \
    {                                                                                              \
        destroy(WorldClass::kind, WorldFunction::Delete, CULLET_CALLER, self);                     \
    }                                                                                              \
    CULLET_EXPORT void cullet##kind##Destroy(void* self) asm(symbol "D1Ev");                       \
    CULLET_EXPORT void cullet##kind##Destroy(void* self)                                           \
    {                                                                                              \
        destroy(WorldClass::kind, WorldFunction::Destroy, CULLET_CALLER, self);                    \
    }

CULLET_WORLD_FUNCTIONS(Discrete, CULLET_DISCRETE_WORLD, CULLET_WORLD_ARGUMENTS,
                       "a class derived from btDiscreteDynamicsWorld")
CULLET_WORLD_FUNCTIONS(Simple, CULLET_SIMPLE_WORLD, CULLET_WORLD_ARGUMENTS,
                       "a class derived from btSimpleDynamicsWorld")
CULLET_WORLD_FUNCTIONS(MultiBody, CULLET_MULTI_BODY_WORLD, CULLET_MULTI_BODY_ARGUMENTS,
                       "a class derived from btMultiBodyDynamicsWorld")
