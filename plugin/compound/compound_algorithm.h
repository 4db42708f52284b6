// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/compound/child_state.h"
#include "cullet/plugin/compound/compound_rest.h"

#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The contacts of a compound with a shape that is none; replaces btCompoundCollisionAlgorithm.
///
/// As in Bullet, each child that is near has an algorithm, which the dispatcher's table makes, and they are created,
/// processed and destroyed in Bullet's order. Shapes, transforms and the tree of the compound are read in every call, so
/// that edits in place are seen at once; what is remembered says which children have algorithms, and of which class.
///
/// Less than in Bullet is done for a child: its box is computed once, that of the other shape once for all, and no list of
/// all children is read. A child far from a plane, without contacts, is left out. Algorithms of cullet refresh their
/// manifold when they are processed, as those of bodies do, and not before, too.
///
/// Left to Bullet's loop: queries outside of a step or with a distance threshold, lack of memory.
class CompoundAlgorithm : public btCompoundCollisionAlgorithm
{
public:
    /// @param isSwapped the second body is the compound
    CompoundAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                      const btCollisionObjectWrapper* b, bool isSwapped);
    ~CompoundAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;
    void getAllContactManifolds(btManifoldArray& manifolds) override;

    /// For the dispatcher of bodies.
    CompoundRest& rest() { return m_rest; }

protected:
    /// Destroys the algorithms of all children.
    void clearChildren();
    /// Whether any manifold has a point.
    bool hasContacts();

private:
    class Pass;
    struct Children;

    void process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                 const btDispatcherInfo& info, btManifoldResult& result);

    Children* children(const btCollisionObjectWrapper& compound, const btCollisionObjectWrapper& other);
    void updateChildren(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b);
    void refreshFirst(Children& children, btManifoldResult& result);
    void destroyFarChildren(Children& children, const Pass& pass, btManifoldResult& result);

    std::unique_ptr<Children> m_children;  ///< null until the first call, or out of memory
    CompoundRest m_rest;
};

// Bullet's pool has elements of this size and ignores the requested size.
static_assert(sizeof(CompoundAlgorithm) <= 192, "too large for the pool of Bullet's configuration");
}  // namespace CULLET_PRECISION
}  // namespace cullet
