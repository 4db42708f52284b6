// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program that queries the public trees of its broad phase, as engines do for culling and picking.

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <cstdio>

namespace
{
struct Counter : btDbvt::ICollide
{
    void Process(const btDbvtNode*) override { ++count; }
    int count = 0;
};

template <class Walk>
int countOf(const btDbvtBroadphase& broadphase, const Walk& walk)
{
    Counter counter;
    for (const btDbvt& tree : broadphase.m_sets)
    {
        if (!tree.empty())
            walk(tree, counter);
    }
    return counter.count;
}
}  // namespace

int main()
{
    btDbvtBroadphase broadphase;
    for (int i = 0; i < 3; ++i)
    {
        const btVector3 low(btScalar(4 * i), 0, 0);
        broadphase.createProxy(low, low + btVector3(1, 1, 1), 0, nullptr, 1, -1, nullptr);
    }
    const btVector3 from(-9, btScalar(0.5), btScalar(0.5)), to(99, btScalar(0.5), btScalar(0.5));
    const btDbvtVolume box = btDbvtVolume::FromMM(btVector3(4, 0, 0), btVector3(5, 1, 1));
    const int all = countOf(
        broadphase, [](const btDbvt& tree, Counter& counter) { btDbvt::enumLeaves(tree.m_root, counter); });
    const int inBox = countOf(
        broadphase, [&](const btDbvt& tree, Counter& counter) { tree.collideTV(tree.m_root, box, counter); });
    const int onRay = countOf(broadphase, [&](const btDbvt& tree, Counter& counter)
                              { btDbvt::rayTest(tree.m_root, from, to, counter); });
    std::printf("found %d %d %d\n", all, inBox, onRay);
}
