// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A plain Bullet program for timing: balls and hulls that fall onto hilly ground. Prints the median time of a step.

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>

#include "falling_things.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

namespace
{
constexpr int kSide = 129;

std::vector<btScalar> hills()
{
    std::vector<btScalar> heights;
    for (int i = 0; i < kSide * kSide; ++i)
        heights.push_back(btScalar(std::sin(0.2 * (i % kSide)) + std::cos(0.2 * (i / kSide))));
    return heights;
}

void makeHull(btConvexHullShape& hull, std::mt19937& random)
{
    std::normal_distribution<btScalar> normal;
    for (int i = 0; i < 32; ++i)
    {
        // In the order in which GCC evaluates arguments.
        const btScalar z = normal(random), y = normal(random), x = normal(random);
        hull.addPoint(btVector3(x, y, z).normalized() * btScalar(0.4));
    }
}

class Rain
{
public:
    explicit Rain(int bodyCount)
    {
        m_world.setGravity(btVector3(0, -10, 0));
        makeHull(m_hull, m_random);
        add(m_terrain, 0, btVector3(0, 0, 0));
        std::uniform_real_distribution<btScalar> across(-60, 60), up(3, 20);
        for (int i = 0; i < bodyCount; ++i)
        {
            const btScalar x = across(m_random), y = up(m_random), z = across(m_random);
            add(i % 2 ? static_cast<btCollisionShape&>(m_hull) : m_ball, 1, btVector3(x, y, z));
        }
    }
    ~Rain()
    {
        for (auto& body : m_bodies)
            m_world.removeRigidBody(body.get());
    }
    Rain(const Rain&) = delete;
    Rain& operator=(const Rain&) = delete;

    double millisecondsOfAStep()
    {
        const auto start = std::chrono::steady_clock::now();
        m_world.stepSimulation(btScalar(1) / 60, 0);
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    }
    void addTo(Result& result) const
    {
        for (const auto& body : m_bodies)
        {
            const btVector3& at = body->getWorldTransform().getOrigin();
            result.add(double(at.x()), double(at.y()), double(at.z()));
        }
    }

private:
    void add(btCollisionShape& shape, btScalar mass, const btVector3& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(mass, inertia);
        m_bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
        m_bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        m_world.addRigidBody(m_bodies.back().get());
    }

    std::mt19937 m_random{1};
    std::vector<btScalar> m_heights = hills();
    btHeightfieldTerrainShape m_terrain{kSide, kSide, m_heights.data(), 1, -2, 2, 1, PHY_FLOAT, false};
    btSphereShape m_ball{btScalar(0.4)};
    btConvexHullShape m_hull;
    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btDbvtBroadphase m_broadphase;
    btSequentialImpulseConstraintSolver m_solver;
    btDiscreteDynamicsWorld m_world{&m_dispatcher, &m_broadphase, &m_solver, &m_configuration};
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};
}  // namespace

int main(int count, char** arguments)
{
    Rain rain(count > 1 ? std::atoi(arguments[1]) : 4000);
    std::vector<double> times(count > 2 ? std::size_t(std::atoi(arguments[2])) : 60);
    for (double& time : times)
        time = rain.millisecondsOfAStep();
    std::nth_element(times.begin(), times.begin() + std::ptrdiff_t(times.size() / 2), times.end());
    std::printf("step %.2f ms\n", times[times.size() / 2]);
    Result result;
    rain.addTo(result);
    result.print();
}
