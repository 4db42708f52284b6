// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include <unordered_map>

struct btBroadphaseProxy;

namespace cullet::preload
{
/// Keeps the public tree of a btDbvtBroadphase up to date for a program that traverses it, to cull by a camera's
/// frustum for example. The program casts the data of a leaf to btBroadphaseProxy*.
///
/// Costs as much as Bullet's own tree, so it is created only if required.
class PublicTrees
{
public:
    /// @param tree empty; must outlive this object
    explicit PublicTrees(btDbvt& tree) : m_tree(tree) {}

    /// The leaf of each proxy has the box of the proxy.
    void insert(btBroadphaseProxy& proxy);
    void update(btBroadphaseProxy& proxy);
    void remove(const btBroadphaseProxy& proxy);

private:
    btDbvt& m_tree;
    std::unordered_map<const btBroadphaseProxy*, btDbvtNode*> m_leaves;
};
}  // namespace cullet::preload
