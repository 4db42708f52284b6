// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/core/class_memo.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <array>
#include <cstdint>
#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How the contacts of a pair may be computed.
enum class PairKind : std::uint8_t
{
    Unknown,  ///< may do anything: an algorithm of the application, or of a dispatcher that shares the pair cache
    InOrder,  ///< Bullet's own algorithm, which changes nothing but its manifolds, but may create and release some
    /// Jobs: they read two bodies and their shapes, and write to their algorithm and its only manifold, which exists.
    IsaGjk,
    Boxes,
    Round,  ///< spheres, capsules, or a sphere and a box
    Plane,
    Mesh,  ///< creates an algorithm per triangle, too; see ChildMemory
    /// A job with algorithms and manifolds that come and go; see ManifoldRecord.
    Compound
};

/// Whether Bullet asks the application about pairs of a compound's children.
bool hasCallbackOfChildren();

inline bool isJob(PairKind kind)
{
    return kind > PairKind::InOrder;
}

/// Finds the kinds of pairs during one dispatch. For the thread of the dispatch.
///
/// A pair is a job only if both shapes, and all their parts, are exactly of classes of Bullet: a derived class may override
/// functions, which may write to the shape.
class PairKinds
{
public:
    using CreateFuncs =
        btCollisionAlgorithmCreateFunc* const (*)[MAX_BROADPHASE_COLLISION_TYPES];  ///< of pairs of types

    /// @param createFuncs            the table of the dispatcher
    /// @param callbacksAreThreadSafe see DispatcherOptions
    PairKinds(const btDispatcher& dispatcher, const IsaGjkRegistration& isaGjk, CreateFuncs createFuncs,
              bool callbacksAreThreadSafe)
        : m_dispatcher(dispatcher),
          m_isaGjk(isaGjk),
          m_createFuncs(createFuncs),
          m_callbacksAreThreadSafe(callbacksAreThreadSafe)
    {
    }

    PairKind kindOf(btCollisionAlgorithm& algorithm, const btCollisionObject& a, const btCollisionObject& b);

private:
    enum class Algorithm : std::uint8_t
    {
        Unknown,
        InOrder,
        Compound,  ///< with children that the table of create functions makes
        IsaGjk,
        Boxes,
        Spheres,
        Convex,
        Plane,
        Mesh
    };
    enum class Shape : std::uint8_t
    {
        Unknown,
        Convex,
        Plane,
        Mesh,
        Compound
    };
    static Algorithm classOf(const btCollisionAlgorithm& algorithm);
    static Shape classOf(const btCollisionShape& shape);
    Shape shapeOf(const btCollisionShape& shape);
    Shape shapeOf(const btCollisionObject& body) { return shapeOf(*body.getCollisionShape()); }
    bool isKnownPart(const btCollisionShape& shape);
    bool isKnownCompound(const btCompoundShape& compound);
    bool areConvex(const btCollisionObject& a, const btCollisionObject& b);
    PairKind roundOrOther(btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                          const btCollisionObject& b);
    PairKind meshOrOther(const btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                         const btCollisionObject& b);
    PairKind compoundOrOther(const btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                             const btCollisionObject& b);
    PairKind parent();
    bool isKnown(const btCollisionAlgorithmCreateFunc& create) const;
    bool isJobOfChildren(int a, int b) const;

    enum class Children : std::uint8_t
    {
        NotExamined,
        Unknown,
        InOrder,  ///< known, but not all of them may be processed on any thread
        Jobs
    };
    Children children();

    /// What a compound was found to be.
    struct CompoundEntry
    {
        const btCompoundShape* shape;  ///< null: none
        bool isKnown;
    };

    const btDispatcher& m_dispatcher;
    const IsaGjkRegistration& m_isaGjk;
    CreateFuncs m_createFuncs;
    bool m_callbacksAreThreadSafe;
    ClassMemo<Algorithm> m_algorithms;
    ClassMemo<Shape> m_shapes;
    using CompoundEntries = std::array<CompoundEntry, 64>;
    std::optional<CompoundEntries> m_compounds;  ///< by a hash of the address; none before the first compound
    btManifoldArray m_manifolds;                 ///< scratch
    Children m_children = Children::NotExamined;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
