// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A plug-in that exports its own Bullet, as if linked statically without hidden symbols. Its content is arbitrary; here
// it is nearly empty.

#include <cstdio>

class btOverlappingPairCache;

__attribute__((visibility("default"))) float gDbvtMargin = 0.05f;

struct __attribute__((visibility("default"))) btDbvtBroadphase
{
    explicit btDbvtBroadphase(btOverlappingPairCache* cache);
    virtual ~btDbvtBroadphase();
    int value = 0;
};

[[gnu::noinline]] btDbvtBroadphase::btDbvtBroadphase(btOverlappingPairCache*) : value(7) {}
[[gnu::noinline]] btDbvtBroadphase::~btDbvtBroadphase()
{
    std::printf("foreign %d\n", value);
}

extern "C" __attribute__((visibility("default"))) void runTowers(const char*)
{
    btDbvtBroadphase broadphase(nullptr);
}
