// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>

// Mangled names of constructors and destructors; see bullet_functions.h.
#define CULLET_DISCRETE_WORLD "_ZN23btDiscreteDynamicsWorld"
#define CULLET_SIMPLE_WORLD "_ZN21btSimpleDynamicsWorld"
#define CULLET_MULTI_BODY_WORLD "_ZN24btMultiBodyDynamicsWorld"
#define CULLET_SOLVER "_ZN35btSequentialImpulseConstraintSolver"
#define CULLET_WORLD_ARGUMENTS \
    "EP12btDispatcherP21btBroadphaseInterfaceP18btConstraintSolverP24btCollisionConfiguration"
#define CULLET_MULTI_BODY_ARGUMENTS \
    "EP12btDispatcherP21btBroadphaseInterfaceP27btMultiBodyConstraintSolverP24btCollisionConfiguration"

namespace cullet::preload
{
/// The worlds and the solver of Bullet that the preloaded library replaces.
enum class DynamicsClass
{
    Discrete,
    Simple,
    MultiBody,
    Solver
};

enum class DynamicsFunction
{
    Construct,
    ConstructBase,
    Delete,
    Destroy
};

inline constexpr std::size_t kDynamicsClassCount = 4, kDynamicsFunctionCount = 4;

/// Symbol names in the order of DynamicsClass and DynamicsFunction.
inline constexpr const char* kDynamicsFunctionNames[kDynamicsClassCount][kDynamicsFunctionCount] = {
    {CULLET_DISCRETE_WORLD "C1" CULLET_WORLD_ARGUMENTS, CULLET_DISCRETE_WORLD "C2" CULLET_WORLD_ARGUMENTS,
     CULLET_DISCRETE_WORLD "D0Ev", CULLET_DISCRETE_WORLD "D1Ev"},
    {CULLET_SIMPLE_WORLD "C1" CULLET_WORLD_ARGUMENTS, CULLET_SIMPLE_WORLD "C2" CULLET_WORLD_ARGUMENTS,
     CULLET_SIMPLE_WORLD "D0Ev", CULLET_SIMPLE_WORLD "D1Ev"},
    {CULLET_MULTI_BODY_WORLD "C1" CULLET_MULTI_BODY_ARGUMENTS,
     CULLET_MULTI_BODY_WORLD "C2" CULLET_MULTI_BODY_ARGUMENTS, CULLET_MULTI_BODY_WORLD "D0Ev",
     CULLET_MULTI_BODY_WORLD "D1Ev"},
    {CULLET_SOLVER "C1Ev", CULLET_SOLVER "C2Ev", CULLET_SOLVER "D0Ev", CULLET_SOLVER "D1Ev"},
};

/// Arguments of the constructors of worlds: pointers of the program to Bullet's types.
struct WorldArguments
{
    void* dispatcher;
    void* broadphase;
    void* solver;
    void* configuration;
};
}  // namespace cullet::preload
