// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/class_memo.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/isa_gjk.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <array>
#include <cstdint>

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
    Mesh  ///< creates an algorithm per triangle, too; see ChildMemory
};

inline bool isJob(PairKind kind)
{
    return kind > PairKind::InOrder;
}

/// Finds the kinds of pairs during one dispatch. For the thread of the dispatch.
///
/// A pair is a job only if both shapes are exactly of classes of Bullet: a derived class may override functions, which
/// may write to the shape.
class PairKinds
{
public:
    using CreateFuncs =
        btCollisionAlgorithmCreateFunc* const (*)[MAX_BROADPHASE_COLLISION_TYPES];  ///< of pairs of types

    /// @param createFuncs the table of the dispatcher
    PairKinds(const btDispatcher& dispatcher, const IsaGjkRegistration& isaGjk, CreateFuncs createFuncs)
        : m_dispatcher(dispatcher), m_isaGjk(isaGjk), m_createFuncs(createFuncs)
    {
    }

    PairKind kindOf(btCollisionAlgorithm& algorithm, const btCollisionObject& a, const btCollisionObject& b);

private:
    enum class Algorithm : std::uint8_t
    {
        Unknown,
        InOrder,
        Parent,  ///< with children that the table of create functions makes
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
        Mesh
    };
    static Algorithm classOf(const btCollisionAlgorithm& algorithm);
    static Shape classOf(const btCollisionShape& shape);
    Shape shapeOf(const btCollisionObject& body);
    bool areConvex(const btCollisionObject& a, const btCollisionObject& b);
    PairKind roundOrOther(btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                          const btCollisionObject& b);
    PairKind meshOrOther(const btCollisionAlgorithm& algorithm, const btCollisionObject& a,
                         const btCollisionObject& b);
    PairKind parent();
    bool knowsAllChildren() const;
    bool isKnown(const btCollisionAlgorithmCreateFunc* create) const;

    const btDispatcher& m_dispatcher;
    const IsaGjkRegistration& m_isaGjk;
    CreateFuncs m_createFuncs;
    ClassMemo<Algorithm> m_algorithms;
    ClassMemo<Shape> m_shapes;
    btManifoldArray m_manifolds;  ///< scratch
    enum class Children : std::uint8_t
    {
        NotExamined,
        Known,
        Unknown
    } m_children = Children::NotExamined;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
