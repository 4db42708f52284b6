// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program compiled with _GLIBCXX_DEBUG, against a library compiled without it: passes if pairs, boxes and contacts
// are right, also where arrays are passed between both.

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cstdio>
#include <cullet/broad/backend.h>
#include <cullet/broad/proxy_table.h>
#include <cullet/plugin/broadphase.h>
#include <cullet/plugin/convex_dispatcher.h>
#include <cullet/plugin/pair_cache/pair_cache.h>
#include <cullet/plugin/world.h>
#include <memory>
#include <utility>
#include <vector>

#ifndef _GLIBCXX_DEBUG
#error "this program is to be compiled with debug containers"
#endif

namespace
{
int failures = 0;

void expect(bool isTrue, const char* what)
{
    if (isTrue)
        return;
    std::printf("wrong: %s\n", what);
    ++failures;
}

/// A backend of the program, whose pairs the library reads.
class OwnBackend final : public cullet::Backend
{
public:
    cullet::Status update(const cullet::ProxyView& view, cullet::PairDelta& delta) override
    {
        cullet::Pairs pairs;
        for (std::uint32_t i = 0; i < view.size; ++i)
        {
            for (std::uint32_t j = 0; j < i; ++j)
            {
                if (cullet::overlaps(view.boxes[i], view.boxes[j]))
                    pairs.push_back(cullet::makePair(view.uniqueIds[i], view.uniqueIds[j]));
            }
        }
        std::sort(pairs.begin(), pairs.end());
        delta = {};
        std::set_difference(pairs.begin(), pairs.end(), m_pairs.begin(), m_pairs.end(),
                            std::back_inserter(delta.added));
        std::set_difference(m_pairs.begin(), m_pairs.end(), pairs.begin(), pairs.end(),
                            std::back_inserter(delta.removed));
        m_pairs = pairs;
        return cullet::Status::Ok;
    }
    void restart(const cullet::Pairs& known) override { m_pairs = known; }
    const char* name() const noexcept override { return "own"; }
    cullet::BackendStats stats() const override
    {
        cullet::BackendStats stats;
        stats.pairs = m_pairs.size();
        stats.stages.push_back({"all", 1});
        return stats;
    }

private:
    cullet::Pairs m_pairs;
};

/// Balls and hulls in a heap above the ground, in more than twice the objects of a parallel task.
class Heap
{
public:
    explicit Heap(cullet::Broadphase& ofProgram, cullet::PairCache& cache)
        : broadphase(ofProgram), pairs(cache)
    {
        for (int corner = 0; corner < 8; ++corner)
            hull.addPoint(btVector3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1) *
                          btScalar(0.4));
        add(&ground, 0, btVector3(0, -1, 0));
        for (int i = 0; i < 700; ++i)
            add(i % 2 == 0 ? static_cast<btCollisionShape*>(&ball) : &hull, 1,
                btVector3(btScalar(i % 10), btScalar(i / 100) + btScalar(0.5), btScalar(i / 10 % 10)));
        for (int step = 0; step < 30; ++step)
            world.stepSimulation(btScalar(1) / 60, 0);
    }
    ~Heap()
    {
        for (const std::unique_ptr<btRigidBody>& body : bodies)
            world.removeRigidBody(body.get());
    }
    Heap(const Heap&) = delete;
    Heap& operator=(const Heap&) = delete;

    void check()
    {
        expect(world.updateStats().parallelBoxes == bodies.size(), "boxes computed on the threads");
        expect(broadphase.table().size() == bodies.size(), "rows of the table");
        std::size_t count = 0;
        bool areAllThere = true;
        for (std::size_t i = 0; i < bodies.size(); ++i)
        {
            for (std::size_t j = 0; j < i; ++j)
            {
                btBroadphaseProxy *a = bodies[j]->getBroadphaseHandle(),
                                  *b = bodies[i]->getBroadphaseHandle();
                if (!TestAabbAgainstAabb2(a->m_aabbMin, a->m_aabbMax, b->m_aabbMin, b->m_aabbMax))
                    continue;
                ++count;
                areAllThere = areAllThere && pairs.findPair(a, b) != nullptr;
            }
        }
        expect(count > 2000 && areAllThere, "pairs of boxes that overlap");
        expect(pairs.isConsistent(), "hash, lists and array of the pair cache");
        expect(pairs.stats().pairs == broadphase.stats().pairs, "number of pairs");
        int contacts = 0;
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
            contacts += dispatcher.getManifoldByIndexInternal(i)->getNumContacts();
        expect(contacts > 700, "contacts of a heap");
        for (const std::unique_ptr<btRigidBody>& body : bodies)
            areAllThere = areAllThere && body->getWorldTransform().getOrigin().y() > btScalar(-1.1);
        expect(areAllThere, "bodies above the ground");
    }

    cullet::Broadphase& broadphase;
    cullet::PairCache& pairs;

private:
    void add(btCollisionShape* shape, btScalar mass, const btVector3& at)
    {
        bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, btVector3(1, 1, 1) * mass));
        bodies.back()->translate(at);
        world.addRigidBody(bodies.back().get());
    }

    btDefaultCollisionConfiguration configuration;
    cullet::Dispatcher dispatcher{&configuration};
    btSequentialImpulseConstraintSolver solver;
    cullet::World<btDiscreteDynamicsWorld> world{&dispatcher, &broadphase, &solver, &configuration};
    btBoxShape ground{btVector3(50, 1, 50)};
    btSphereShape ball{btScalar(0.5)};
    btConvexHullShape hull;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

void checkHeaps()
{
    cullet::PairCache pairs, otherPairs;
    cullet::Broadphase broadphase(&pairs);
    Heap(broadphase, pairs).check();
    cullet::Broadphase other(std::make_unique<OwnBackend>(), &otherPairs);
    Heap heap(other, otherPairs);
    heap.check();
    expect(other.stats().backend.stages.size() == 1, "stages of the program's own backend");
}

/// Checks a backend of the library, whose pairs the program reads.
void checkBackend(std::unique_ptr<cullet::Backend> backend)
{
    cullet::ProxyTable table;
    for (std::uint32_t i = 0; i < 500; ++i)
    {
        const float at = static_cast<float>(i);
        table.create({{at, 0, 0}, {at + 1, 1, 1}}, i + 1, {1, -1});
    }
    cullet::PairDelta delta;
    expect(backend->update(table.beginUpdate(0, true), delta) == cullet::Status::Ok, "update of a backend");
    table.endUpdate();
    expect(delta.added.size() == 499 && delta.removed.empty(), "pairs that entered");
    expect(delta.added.back() == cullet::Pair{499, 500}, "the last pair");
    table.setBox(0, {{9000, 0, 0}, {9001, 1, 1}});
    cullet::Array<cullet::ProxyId> rows;
    table.collectQueryChanges(rows);
    expect(rows.size() == 500, "rows that changed");
    backend->update(table.beginUpdate(0, true), delta);
    expect(delta.added.empty() && delta.removed.size() == 1 && delta.removed[0] == cullet::Pair{1, 2},
           "pairs that left");
    expect(backend->stats().stages.empty() && backend->stats().pairs == 498, "statistics of a backend");
}
}  // namespace

int main()
{
    checkHeaps();
    checkBackend(cullet::makeGridBackend());
    checkBackend(cullet::makeBruteForceBackend());
    std::printf("scalar of %zu bytes, %d wrong\n", sizeof(btScalar), failures);
    return failures == 0 ? 0 : 1;
}
