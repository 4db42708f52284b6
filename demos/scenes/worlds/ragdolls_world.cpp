// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/ragdolls_world.h"

#include "cullet/demos/scenes/splitmix64.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr double kQuarter = 0.7853981633974483;  ///< of a half turn

/// A capsule of a doll that stands at the origin, metres.
struct Limb
{
    double radius, length;  ///< length: without the caps
    double x, y;            ///< of its centre
    bool isLevel;           ///< along x, otherwise along y
};

constexpr Limb kLimbs[] = {
    {0.15, 0.20, 0, 1, false},        {0.15, 0.28, 0, 1.2, false},     {0.10, 0.05, 0, 1.6, false},
    {0.07, 0.45, -0.18, 0.65, false}, {0.05, 0.37, -0.18, 0.2, false}, {0.07, 0.45, 0.18, 0.65, false},
    {0.05, 0.37, 0.18, 0.2, false},   {0.05, 0.33, -0.35, 1.45, true}, {0.04, 0.25, -0.7, 1.45, true},
    {0.05, 0.33, 0.35, 1.45, true},   {0.04, 0.25, 0.7, 1.45, true},
};
constexpr std::uint32_t kLimbCount = std::size(kLimbs);

enum class Axis
{
    X,
    Y
};

/// A joint between two limbs, at a place of the standing doll.
struct Joint
{
    std::size_t a, b;  ///< of kLimbs
    double x, y;
    bool isHinge;      ///< otherwise a cone with twist
    Axis axis;         ///< of the hinge, or of the twist
    double low, high;  ///< hinge: angles; cone: both swings, twist
};

constexpr Joint kJoints[] = {
    {0, 1, 0, 1.1, true, Axis::X, -kQuarter, 2 * kQuarter},
    {1, 2, 0, 1.5, false, Axis::Y, kQuarter, 2 * kQuarter},
    {0, 3, -0.18, 0.9, false, Axis::Y, kQuarter, 0},
    {3, 4, -0.18, 0.42, true, Axis::X, 0, 2 * kQuarter},
    {0, 5, 0.18, 0.9, false, Axis::Y, kQuarter, 0},
    {5, 6, 0.18, 0.42, true, Axis::X, 0, 2 * kQuarter},
    {1, 7, -0.2, 1.45, false, Axis::X, 2 * kQuarter, 0},
    {7, 8, -0.52, 1.45, true, Axis::Y, -2 * kQuarter, 0},
    {1, 9, 0.2, 1.45, false, Axis::X, 2 * kQuarter, 0},
    {9, 10, 0.52, 1.45, true, Axis::Y, 0, 2 * kQuarter},
};

btVector3 inPlane(double x, double y)
{
    return btVector3(btScalar(x), btScalar(y), 0);
}

class RagdollsWorld : public WorldScene
{
public:
    RagdollsWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        addFloor();
        for (std::size_t i = 0; i < kLimbCount; ++i)
            m_shapes[i] = &makeShape<btCapsuleShape>(btScalar(kLimbs[i].radius), btScalar(kLimbs[i].length));
        const std::uint32_t dolls = std::max(1u, scene.bodies / kLimbCount);
        const auto perSide = static_cast<std::uint32_t>(std::ceil(std::sqrt(dolls)));
        SplitMix64 random(scene.seed);
        for (std::uint32_t i = 0; i < dolls; ++i)
        {
            const btVector3 place(btScalar(i % perSide), 0, btScalar(i / perSide));
            const btQuaternion turn(btVector3(0, 1, 0), btScalar(random.uniform(-3, 3)));
            addDoll(btTransform(turn, place * btScalar(3.5) + btVector3(0, btScalar(0.3), 0)));
        }
        setBodyCount(dolls * kLimbCount);
    }

private:
    using Limbs = std::array<btRigidBody*, kLimbCount>;

    void addDoll(const btTransform& place)
    {
        Limbs limbs;
        for (std::size_t i = 0; i < kLimbCount; ++i)
        {
            const btQuaternion tilt(btVector3(0, 0, 1), kLimbs[i].isLevel ? SIMD_HALF_PI : btScalar(0));
            const btTransform own(tilt, inPlane(kLimbs[i].x, kLimbs[i].y));
            limbs[i] = &addBody(*m_shapes[i], 1, place * own);
            limbs[i]->setDamping(btScalar(0.05), btScalar(0.85));
            limbs[i]->setDeactivationTime(btScalar(0.8));
            limbs[i]->setSleepingThresholds(btScalar(1.6), btScalar(2.5));
        }
        for (const Joint& joint : kJoints)
            addJoint(place, joint, *limbs[joint.a], *limbs[joint.b]);
    }

    void addJoint(const btTransform& place, const Joint& joint, btRigidBody& a, btRigidBody& b)
    {
        // A hinge turns about its z, a cone twists about its x.
        const btVector3 own = joint.isHinge ? btVector3(0, 0, 1) : btVector3(1, 0, 0);
        const btVector3 axis = joint.axis == Axis::X ? btVector3(1, 0, 0) : btVector3(0, 1, 0);
        const btTransform frame = place * btTransform(shortestArcQuat(own, axis), inPlane(joint.x, joint.y));
        const btTransform inA = a.getWorldTransform().inverse() * frame;
        const btTransform inB = b.getWorldTransform().inverse() * frame;
        const btScalar low = btScalar(joint.low), high = btScalar(joint.high);
        if (joint.isHinge)
        {
            auto& hinge = keep(std::make_unique<btHingeConstraint>(a, b, inA, inB));
            hinge.setLimit(low, high);
            world().addConstraint(&hinge, true);
            return;
        }
        auto& cone = keep(std::make_unique<btConeTwistConstraint>(a, b, inA, inB));
        cone.setLimit(low, low, high);
        world().addConstraint(&cone, true);
    }

    std::array<btCollisionShape*, kLimbCount> m_shapes = {};
};
}  // namespace

std::unique_ptr<WorldScene> makeRagdollsScene(const std::string& name, NamedBroadphase broadphase,
                                              const WorldSceneOptions& options)
{
    return std::make_unique<RagdollsWorld>(name, std::move(broadphase), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
