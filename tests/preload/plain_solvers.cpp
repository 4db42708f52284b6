// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program without cullet that makes solvers of Bullet's classes. The arguments select which and how, and the number of
// towers.

#include "cullet/tests/preload/repeated.h"
#include "cullet/tests/preload/solver_scene.h"

#include <BulletDynamics/ConstraintSolver/btNNCGConstraintSolver.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolverMt.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
int g_towers = 30;

/// A class of the program with a member and a function of its own.
class DerivedSolver : public btSequentialImpulseConstraintSolver
{
public:
    void prepareSolve(int bodies, int manifolds) override
    {
        ++m_steps;
        btSequentialImpulseConstraintSolver::prepareSolve(bodies, manifolds);
    }
    int steps() const { return m_steps; }

private:
    int m_steps = 0;
};

template <class World = btDiscreteDynamicsWorld, class Solver>
void runWith(Solver& solver)
{
    SolverWorldParts parts;
    World world(&parts.dispatcher, &parts.broadphase, &solver, &parts.configuration);
    runScene(world, g_towers);
}

void runOnStack()
{
    btSequentialImpulseConstraintSolver solver;
    runWith(solver);
}

void runNew()
{
    const std::unique_ptr<btConstraintSolver> solver(new btSequentialImpulseConstraintSolver);
    runWith(*solver);
}

/// The world makes its solver in Bullet's library.
void runOfWorld()
{
    SolverWorldParts parts;
    btDiscreteDynamicsWorld world(&parts.dispatcher, &parts.broadphase, nullptr, &parts.configuration);
    runScene(world, g_towers);
}

void runDerived()
{
    DerivedSolver solver;
    runWith(solver);
    std::printf("steps %d\n", solver.steps());
}

template <class Solver, class World>
void runOther()
{
    Solver solver;
    runWith<World>(solver);
}

/// Makes and destroys solvers, each at an address of its own, and prints the bytes in use that are left of half of them.
void runMany()
{
    using Solver = btSequentialImpulseConstraintSolver;
    constexpr std::size_t kRoom = sizeof(Solver) + 16;
    std::vector<unsigned char> memory(100 * kRoom);
    unsigned char* next = memory.data();
    const auto makeSome = [&]
    {
        for (int i = 0; i < 50; ++i, next += kRoom)
        {
            void* place = next;
            std::size_t room = kRoom;
            std::align(16, sizeof(Solver), place, room);
            (::new (place) Solver)->~Solver();
        }
    };
    printBytesLeft(makeSome);
}
}  // namespace
}  // namespace cullet::test

int main(int count, char** arguments)
{
    using namespace cullet::test;
    const std::string kind = arguments[1];
    if (count > 2)
        g_towers = std::atoi(arguments[2]);
    if (kind == "heap")
        runNew();
    else if (kind == "stack")
        runOnStack();
    else if (kind == "world")
        runOfWorld();
    else if (kind == "derived")
        runDerived();
    else if (kind == "nncg")
        runOther<btNNCGConstraintSolver, btDiscreteDynamicsWorld>();
    else if (kind == "mt")
        runOther<btSequentialImpulseConstraintSolverMt, btDiscreteDynamicsWorld>();
    else if (kind == "multi-body")
        runOther<btMultiBodyConstraintSolver, btMultiBodyDynamicsWorld>();
    else if (kind == "many")
        runMany();
    else if (kind == "threads")
        runInFourThreads(runOnStack);
}
