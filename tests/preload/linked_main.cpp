// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The program of plain_towers.cpp ported to cullet: the reference for the preloaded library.

#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/tests/preload/box_towers.h"

#include <string>

int main(int, char** arguments)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    cullet::Broadphase broadphase;
    cullet::IsaGjkOptions options;
    if (arguments[1] == std::string("one-point"))
        options.patchPoints = 1;
    if (arguments[1] == std::string("keeping"))
        options.reusePose.distance = btScalar(0.002);
    if (arguments[1] == std::string("bullets-boxes"))
        options.boxPairs = cullet::BoxPairs::Bullet;
    if (arguments[1] != std::string("broad"))
        cullet::registerIsaGjk(dispatcher, options);
    cullet::test::BoxTowers towers(dispatcher, broadphase, configuration);
    towers.step(240);
    towers.print();
}
