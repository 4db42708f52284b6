// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include <unordered_map>

struct btBroadphaseProxy;

namespace cullet::preload
{
/// Keeps the public tree of a btDbvtBroadphase filled for a program that walks it by itself, to cull by a camera's
/// frustum for example. The program casts the data of a leaf to btBroadphaseProxy*.
///
/// Costs what Bullet's own tree costs, so that it is there only when asked for.
class PublicTrees
{
public:
    /// @param tree empty, outlives this
    explicit PublicTrees(btDbvt& tree) : m_tree(tree) {}

    /// Boxes are those of the proxy.
    void insert(btBroadphaseProxy& proxy);
    void update(btBroadphaseProxy& proxy);
    void remove(const btBroadphaseProxy& proxy);

private:
    btDbvt& m_tree;
    std::unordered_map<const btBroadphaseProxy*, btDbvtNode*> m_leaves;
};
}  // namespace cullet::preload
