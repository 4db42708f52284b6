// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program without cullet, linked with Bullet only. The argument selects how it creates its broad phase.

#include "cullet/tests/preload/box_towers.h"

#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace cullet::test
{
namespace
{
struct DerivedBroadphase : btDbvtBroadphase
{
};

/// Traverses by hand, since the preloaded library would detect a function of btDbvt.
int leavesOf(const btDbvtNode* node)
{
    if (node == nullptr)
        return 0;
    return node->isleaf() ? 1 : leavesOf(node->childs[0]) + leavesOf(node->childs[1]);
}

void run(btBroadphaseInterface& broadphase, int steps = 240)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    BoxTowers towers(dispatcher, broadphase, configuration);
    towers.step(steps);
    if (const auto* dbvt = dynamic_cast<const btDbvtBroadphase*>(&broadphase))
        std::printf("leaves %d\n", leavesOf(dbvt->m_sets[0].m_root) + leavesOf(dbvt->m_sets[1].m_root));
    towers.print();
}

/// Calls every function of the concrete type, which a compiler may call without the virtual table.
void runDirectly()
{
    btDbvtBroadphase broadphase;
    const btVector3 zero(0, 0, 0), one(1, 1, 1), half(btScalar(0.5), btScalar(0.5), btScalar(0.5));
    btBroadphaseProxy* a = broadphase.createProxy(zero, one, 0, nullptr, 1, -1, nullptr);
    btBroadphaseProxy* b = broadphase.createProxy(half, one, 0, nullptr, 1, -1, nullptr);
    broadphase.collide(nullptr);
    broadphase.optimize();
    broadphase.performDeferredRemoval(nullptr);
    std::printf("pairs %d\n", broadphase.getOverlappingPairCache()->getNumOverlappingPairs());
    broadphase.setAabbForceUpdate(b, btScalar(4) * one, btScalar(5) * one, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    std::printf("pairs %d\n", broadphase.getOverlappingPairCache()->getNumOverlappingPairs());
    btVector3 low, high;
    broadphase.getBroadphaseAabb(low, high);
    std::printf("bounds %g %g\n", double(low.x()), double(high.x()));
    broadphase.setAabb(b, zero, half, nullptr);
    broadphase.getAabb(b, low, high);
    std::printf("box %g %g\n", double(low.x()), double(high.x()));
    broadphase.printStats();
    broadphase.destroyProxy(a, nullptr);
    broadphase.destroyProxy(b, nullptr);
    broadphase.resetPool(nullptr);
    a = broadphase.createProxy(zero, one, 0, nullptr, 1, -1, nullptr);
    std::printf("id %d\n", a->m_uniqueId);
    broadphase.destroyProxy(a, nullptr);
}

void runInMemoryOfItsOwn()
{
    void* memory = btAlignedAlloc(sizeof(btDbvtBroadphase), 16);
    auto* broadphase = new (memory) btDbvtBroadphase;
    run(*broadphase);
    broadphase->~btDbvtBroadphase();
    btAlignedFree(memory);
}

void runWithAForeignCache()
{
    btDbvtBroadphase broadphase;
    btHashedOverlappingPairCache cache;
    btOverlappingPairCache* own = broadphase.m_paircache;
    broadphase.m_paircache = &cache;
    broadphase.calculateOverlappingPairs(nullptr);
    broadphase.m_paircache = own;
}

void runWithACacheOfItsOwn()
{
    btHashedOverlappingPairCache cache;
    btDbvtBroadphase broadphase(&cache);
    run(broadphase);
}

/// A forked child continues with the world of its parent.
void runInAChild()
{
    btDbvtBroadphase broadphase;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    BoxTowers towers(dispatcher, broadphase, configuration);
    towers.step(100);
    const pid_t child = fork();
    if (child == 0)
    {
        towers.step(140);
        towers.print();
        std::exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    std::printf("child %d\n", status);
}
void runInThreads()
{
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back(
            []
            {
                btDbvtBroadphase broadphase;
                run(broadphase);
            });
    for (std::thread& thread : threads)
        thread.join();
}
}  // namespace
}  // namespace cullet::test

extern "C" __attribute__((visibility("default"))) void runTowers(const char* how)
{
    using namespace cullet::test;
    const std::string kind = how;
    if (kind == "stack")
    {
        btDbvtBroadphase broadphase;
        run(broadphase);
    }
    else if (kind == "heap")
        run(*std::unique_ptr<btBroadphaseInterface>(new btDbvtBroadphase));
    else if (kind == "memory")
        runInMemoryOfItsOwn();
    else if (kind == "derived")
        run(*std::make_unique<DerivedBroadphase>());
    else if (kind == "sweep")
        run(*std::make_unique<btAxisSweep3>(btVector3(-50, -50, -50), btVector3(50, 50, 50)));
    else if (kind == "cache")
        runWithACacheOfItsOwn();
    else if (kind == "foreign")
        runWithAForeignCache();
    else if (kind == "direct")
        runDirectly();
    else if (kind == "threads")
        runInThreads();
    else if (kind == "child")
        runInAChild();
}
