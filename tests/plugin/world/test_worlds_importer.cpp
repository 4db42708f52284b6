// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A world is saved with one broad phase and loaded by Bullet's importer into an empty world with another one.
#include "cullet/tests/plugin/small_world.h"

#include <BulletWorldImporter/btBulletWorldImporter.h>
#include <gtest/gtest.h>

#include <vector>

namespace cullet::test
{
namespace
{
/// The data of Bullet's serialiser for a world of boxes and a compound on a floor.
std::vector<char> savedWorld(btBroadphaseInterface& broadphase)
{
    SmallWorld scene(broadphase);
    scene.add(scene.shape<btBoxShape>(vec(10, 1, 10)), 0, vec(0, -1, 0));
    btBoxShape& box = scene.shape<btBoxShape>(vec(0.5, 0.5, 0.5));
    btCompoundShape& compound = scene.shape<btCompoundShape>();
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), vec(-0.5, 0, 0)), &box);
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), vec(0.5, 0, 0)), &box);
    for (int i = 0; i < 6; ++i)
        scene.add(i % 2 ? static_cast<btCollisionShape&>(compound) : box, 1,
                  vec(3 * (i / 2) - 3, 1 + i % 2 * 1.2, 0));
    scene.step(20);
    btDefaultSerializer serializer;
    scene.world.serialize(&serializer);
    const auto* data = reinterpret_cast<const char*>(serializer.getBufferPointer());
    return std::vector<char>(data, data + serializer.getCurrentBufferSize());
}

/// Heights of the loaded bodies after two seconds.
std::vector<double> loadAndStep(std::vector<char> file, btBroadphaseInterface& broadphase)
{
    SmallWorld scene(broadphase);
    btBulletWorldImporter importer(&scene.world);
    EXPECT_TRUE(importer.loadFileFromMemory(file.data(), static_cast<int>(file.size())));
    scene.world.setGravity(vec(0, -10, 0));
    EXPECT_EQ(scene.world.getNumCollisionObjects(), 7);
    scene.step(120);
    std::vector<double> heights;
    for (int i = 0; i < scene.world.getNumCollisionObjects(); ++i)
        heights.push_back(heightOf(*scene.world.getCollisionObjectArray()[i]));
    while (scene.world.getNumCollisionObjects() > 0)
        scene.world.removeCollisionObject(scene.world.getCollisionObjectArray()[0]);
    importer.deleteAllData();
    return heights;
}

TEST(WorldsImporter, ContinuesWorldSavedWithEitherBroadphaseInTheOther)
{
    Broadphase own;
    btDbvtBroadphase stock;
    const std::vector<char> ownFile = savedWorld(own), stockFile = savedWorld(stock);
    EXPECT_EQ(ownFile.size(), stockFile.size());
    for (const std::vector<char>& file : {ownFile, stockFile})
    {
        expectAsWithDbvt([&](btBroadphaseInterface& broadphase) { return loadAndStep(file, broadphase); },
                         0.01);
        const std::vector<double> heights = loadAndStep(file, own);
        ASSERT_EQ(heights.size(), 7u);
        EXPECT_NEAR(heights[1], 0.5, 0.05);
        EXPECT_NEAR(heights[2], 1.5, 0.05) << "the compound rests on the box";
    }
}
}  // namespace
}  // namespace cullet::test
