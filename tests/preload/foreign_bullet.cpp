// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A plug-in that exports a Bullet of its own, as one does that has linked it statically without hiding its names. What is in
// such a library nobody knows; here it is almost nothing.

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
