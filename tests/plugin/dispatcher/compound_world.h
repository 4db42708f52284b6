// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/dispatcher/crowd_world.h"

#include <algorithm>
#include <deque>

namespace cullet::test
{
/// Which compounds have a tree of their children. Others create algorithms for all of them at once.
enum class Trees
{
    InMost,
    InAll
};

/// Compounds of all kinds fall on a plane, a mesh, a height field and on compounds, while their children change.
class CompoundWorld
{
public:
    static constexpr int kBodies = 48;

    /// @param dispatcher made with `configuration`
    CompoundWorld(unsigned seed, Trees trees, std::unique_ptr<btDefaultCollisionConfiguration> configuration,
                  std::unique_ptr<Dispatcher> made)
        : m_engine(seed),
          m_trees(trees),
          m_configuration(std::move(configuration)),
          m_dispatcher(std::move(made)),
          world(m_dispatcher.get(), &m_broadphase, &m_solver, m_configuration.get())
    {
        addGround();
        for (int i = 0; i < kBodies; ++i)
            addBody(i);
    }
    ~CompoundWorld() { removeBodies(); }
    CompoundWorld(const CompoundWorld&) = delete;
    CompoundWorld& operator=(const CompoundWorld&) = delete;

    btRigidBody& add(btCollisionShape* shape, double mass, const btTransform& at)
    {
        bodies.push_back(makeBodyAt(at, shape, mass));
        bodies.back()->setUserIndex(int(bodies.size()));
        bodies.back()->setActivationState(DISABLE_DEACTIVATION);
        world.addRigidBody(bodies.back().get());
        return *bodies.back();
    }
    void removeBodies()
    {
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
        bodies.clear();
    }
    void step()
    {
        editChildren();
        world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }
    std::uint64_t hash()
    {
        ManifoldLog log(Places::Ignored);
        log.add(*m_dispatcher, *m_broadphase.getOverlappingPairCache());
        points += log.points();
        return log.hash() ^ hashOfBodies(bodies);
    }
    /// @return hashes of all manifolds and bodies after each step
    std::vector<std::uint64_t> run(int steps)
    {
        std::vector<std::uint64_t> hashes;
        for (int i = 0; i < steps; ++i)
        {
            step();
            hashes.push_back(hash());
            mostManifolds = std::max(mostManifolds, m_dispatcher->getNumManifolds());
        }
        return hashes;
    }
    /// Changes a child of a few compounds that are no part of another.
    void editChildren()
    {
        for (int i = 0; i < 2; ++i)
        {
            btCompoundShape& compound = m_compounds[m_engine() % m_compounds.size()];
            const unsigned what = m_engine() % 3;
            if (what == 0 && compound.getNumChildShapes() > 1)
                compound.removeChildShapeByIndex(compound.getNumChildShapes() - 1);
            else if (what == 1 && compound.getNumChildShapes() < 6)
                compound.addChildShape(somewhere(0.4), m_parts.shapeOf(Crowd::Hulls, int(m_engine() % 4)));
            else
                compound.updateChildTransform(0, somewhere(0.2));
            ++edits;
        }
    }
    Dispatcher& dispatcher() { return *m_dispatcher; }
    const ContactStats& stats() const { return m_dispatcher->contactStats(); }
    btDefaultCollisionConfiguration& configuration() { return *m_configuration; }

    int points = 0, edits = 0, mostManifolds = 0;

private:
    btTransform somewhere(double distance)
    {
        std::uniform_real_distribution<double> any(-distance, distance);
        const btQuaternion rotation = randomRotation(m_engine);
        return btTransform(rotation, drawVec(any, m_engine));
    }
    btCompoundShape& newCompound(bool hasTree, int children)
    {
        m_compounds.emplace_back(hasTree || m_trees == Trees::InAll);
        for (int i = 0; i < children; ++i)
        {
            const auto crowd = static_cast<Crowd>(i % 3);
            m_compounds.back().addChildShape(somewhere(0.4), m_parts.shapeOf(crowd, int(m_engine() % 4)));
        }
        return m_compounds.back();
    }
    void addGround()
    {
        add(&m_parts.plane, 0, btTransform::getIdentity());
        m_level.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-8, 0.4, 0)), m_parts.grounds(0));
        m_level.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0, 0.4, 0)), m_parts.grounds(2));
        m_level.addChildShape(btTransform(btQuaternion::getIdentity(), vec(8, 0, 0)), &m_parts.ground);
        add(&m_level, 0, btTransform::getIdentity());
        add(m_parts.grounds(1), 0, btTransform(btQuaternion::getIdentity(), vec(4, 0.3, 0)));
    }
    void addBody(int i)
    {
        std::uniform_real_distribution<double> any(-1.0, 1.0);
        const double x = 9 * any(m_engine), z = 1.5 * any(m_engine);
        btTransform at = somewhere(0.1);
        at.setOrigin(vec(x, 1.2 + 0.08 * i, z));
        add(shapeOf(i), 1, at);
    }
    btCollisionShape* shapeOf(int i)
    {
        switch (i % 6)
        {
            case 0:
                return &newCompound(true, 3);
            case 1:
                return &newCompound(false, 3);
            case 2:
                return &m_compounds[m_engine() % m_compounds.size()];  // shared
            case 3:
                return nested();
            case 4:
                return m_parts.shapeOf(Crowd::Hulls, i);
            default:
                return m_parts.shapeOf(static_cast<Crowd>(1 + i / 6 % 2), i);
        }
    }
    btCollisionShape* nested()
    {
        btCompoundShape& inner = newCompound(m_engine() % 2 == 0, 2);
        m_nested.emplace_back();
        m_nested.back().addChildShape(somewhere(0.3), &inner);
        m_nested.back().addChildShape(somewhere(0.3), m_parts.shapeOf(Crowd::Boxes, 0));
        return &m_nested.back();
    }

    std::mt19937 m_engine;
    Trees m_trees;
    CrowdShapes m_parts;
    std::deque<btCompoundShape> m_compounds, m_nested;
    btCompoundShape m_level;
    std::unique_ptr<btDefaultCollisionConfiguration> m_configuration;
    std::unique_ptr<Dispatcher> m_dispatcher;
    btDbvtBroadphase m_broadphase;
    btSequentialImpulseConstraintSolver m_solver;

public:
    btDiscreteDynamicsWorld world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

template <class Made = Dispatcher>
std::unique_ptr<CompoundWorld> makeCompounds(unsigned seed, const DispatcherOptions& options,
                                             Trees trees = Trees::InMost)
{
    auto configuration = std::make_unique<btDefaultCollisionConfiguration>();
    auto dispatcher = std::make_unique<Made>(configuration.get(), options);
    return std::make_unique<CompoundWorld>(seed, trees, std::move(configuration), std::move(dispatcher));
}
}  // namespace cullet::test
