// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

#include <btBulletDynamicsCommon.h>

#include <cullet/plugin/broadphase.h>

int main()
{
    cullet::Broadphase broadphase;
    for (int x = 0; x < 2; ++x)
        broadphase.createProxy(btVector3(btScalar(x), 0, 0), btVector3(btScalar(x + 1), 1, 1),
                               BOX_SHAPE_PROXYTYPE, nullptr, 1, -1, nullptr);
    broadphase.calculateOverlappingPairs(nullptr);
    return broadphase.getOverlappingPairCache()->getNumOverlappingPairs() == 1 ? 0 : 1;
}
