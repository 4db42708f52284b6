// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/public_trees.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

namespace cullet::preload
{
namespace
{
btDbvtVolume volumeOf(const btBroadphaseProxy& proxy)
{
    return btDbvtVolume::FromMM(proxy.m_aabbMin, proxy.m_aabbMax);
}
}  // namespace

void PublicTrees::insert(btBroadphaseProxy& proxy)
{
    m_leaves[&proxy] = m_tree.insert(volumeOf(proxy), &proxy);
}

void PublicTrees::update(btBroadphaseProxy& proxy)
{
    btDbvtVolume volume = volumeOf(proxy);
    btDbvtNode* leaf = m_leaves.at(&proxy);
    if (NotEqual(leaf->volume, volume))
        m_tree.update(leaf, volume);
}

void PublicTrees::remove(const btBroadphaseProxy& proxy)
{
    const auto found = m_leaves.find(&proxy);
    m_tree.remove(found->second);
    m_leaves.erase(found);
}
}  // namespace cullet::preload
