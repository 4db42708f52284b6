// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The constructors and destructors of Bullet's worlds and solver that a program binds to this library first; see
// interpose.cpp. A function of a world that is called without its virtual table is Bullet's own: a cullet::World does the
// same, bit for bit. So is one of a solver, which compilers do not call so but in derived classes: solvers are used through
// worlds.

#include "cullet/preload/bullet_library.h"
#include "cullet/preload/exported.h"

namespace
{
using cullet::preload::BulletLibrary;
using cullet::preload::DynamicsClass;
using cullet::preload::DynamicsFunction;
using cullet::preload::WorldArguments;

/// Objects of Bullet's own classes that this thread is constructing. Their base classes are no classes of the program.
thread_local int t_constructing = 0;

void callConstructor(const BulletLibrary& bullet, DynamicsClass kind, DynamicsFunction function,
                     const void* caller, void* self, const WorldArguments& arguments)
{
    void* address = cullet::preload::dynamicsFunction(bullet, kind, function, caller);
    ++t_constructing;
    if (kind == DynamicsClass::Solver)
        reinterpret_cast<void (*)(void*)>(address)(self);
    else
        reinterpret_cast<void (*)(void*, void*, void*, void*, void*)>(address)(
            self, arguments.dispatcher, arguments.broadphase, arguments.solver, arguments.configuration);
    --t_constructing;
}

void construct(DynamicsClass kind, const void* caller, void* self, const WorldArguments& arguments)
{
    const BulletLibrary& bullet = cullet::preload::libraryFor(caller);
    if (cullet::preload::ownsClass(bullet, kind, caller) &&
        bullet.implementation->constructDynamics(kind, self, arguments))
        return;
    callConstructor(bullet, kind, DynamicsFunction::Construct, caller, self, arguments);
}

void constructBase(DynamicsClass kind, const char* derived, const void* caller, void* self,
                   const WorldArguments& arguments)
{
    const BulletLibrary& bullet = cullet::preload::libraryFor(caller);
    const auto* own = bullet.implementation;
    // The stand-in derives from Bullet's class.
    if (own != nullptr && t_constructing == 0 &&
        cullet::preload::baseOf(caller) != cullet::preload::baseOf(own))
        own->keepDynamics(kind, derived);
    callConstructor(bullet, kind, DynamicsFunction::ConstructBase, caller, self, arguments);
}

WorldArguments packed()
{
    return {};
}

WorldArguments packed(void* dispatcher, void* broadphase, void* solver, void* configuration)
{
    return {dispatcher, broadphase, solver, configuration};
}

void destroy(DynamicsClass kind, DynamicsFunction how, const void* caller, void* self)
{
    const BulletLibrary& bullet = cullet::preload::knownLibraryFor(caller);
    if (bullet.implementation != nullptr && bullet.implementation->destroyDynamics(kind, self, how))
        return;
    reinterpret_cast<void (*)(void*)>(cullet::preload::dynamicsFunction(bullet, kind, how, caller))(self);
}
}  // namespace

// Defines the functions of one class. The parentheses of `parameters` and `arguments` are theirs.
#define CULLET_DYNAMICS_FUNCTIONS(kind, symbol, mangled, parameters, arguments, derived)    \
    CULLET_EXPORT void cullet##kind##Construct parameters asm(symbol "C1" mangled);         \
    CULLET_EXPORT void cullet##kind##Construct parameters                                   \
    {                                                                                       \
        construct(DynamicsClass::kind, CULLET_CALLER, self, packed arguments);              \
    }                                                                                       \
    CULLET_EXPORT void cullet##kind##ConstructBase parameters asm(symbol "C2" mangled);     \
    CULLET_EXPORT void cullet##kind##ConstructBase parameters                               \
    {                                                                                       \
        constructBase(DynamicsClass::kind, derived, CULLET_CALLER, self, packed arguments); \
    }                                                                                       \
    CULLET_EXPORT void cullet##kind##Delete(void* self) asm(symbol "D0Ev");                 \
    CULLET_EXPORT void cullet##kind##Delete(void* self)                                     \
    {                                                                                       \
        destroy(DynamicsClass::kind, DynamicsFunction::Delete, CULLET_CALLER, self);        \
    }                                                                                       \
    CULLET_EXPORT void cullet##kind##Destroy(void* self) asm(symbol "D1Ev");                \
    CULLET_EXPORT void cullet##kind##Destroy(void* self)                                    \
    {                                                                                       \
        destroy(DynamicsClass::kind, DynamicsFunction::Destroy, CULLET_CALLER, self);       \
    }
#define CULLET_WORLD_FUNCTIONS(kind, symbol, mangled, derived)                                         \
    CULLET_DYNAMICS_FUNCTIONS(kind, symbol, mangled, (void* self, void* a, void* b, void* c, void* d), \
                              (a, b, c, d), derived)

CULLET_WORLD_FUNCTIONS(Discrete, CULLET_DISCRETE_WORLD, CULLET_WORLD_ARGUMENTS,
                       "a class derived from btDiscreteDynamicsWorld")
CULLET_WORLD_FUNCTIONS(Simple, CULLET_SIMPLE_WORLD, CULLET_WORLD_ARGUMENTS,
                       "a class derived from btSimpleDynamicsWorld")
CULLET_WORLD_FUNCTIONS(MultiBody, CULLET_MULTI_BODY_WORLD, CULLET_MULTI_BODY_ARGUMENTS,
                       "a class derived from btMultiBodyDynamicsWorld")
CULLET_DYNAMICS_FUNCTIONS(Solver, CULLET_SOLVER, "Ev", (void* self), (),
                          "a class derived from btSequentialImpulseConstraintSolver")
