// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// mesh_query_times [cells per side]: what rays and sweeps against a terrain cost in Bullet and with a prepared mesh.
// No test: it is run by hand. Both take turns, a few queries each; times are processor times, medians over rounds.
#include "cullet/plugin/prepared_mesh.h"
#include "cullet/plugin/world_queries.h"
#include "cullet/tests/plugin/queries/query_mesh.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace cullet::test
{
namespace
{
double processorTime()
{
    std::timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) * 1e6 + static_cast<double>(time.tv_nsec) * 1e-3;
}

template <class Body>
double timeOf(const Body& body)
{
    const double before = processorTime();
    body();
    return processorTime() - before;
}

double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// Hills of 2 m, with bumps, in a square grid.
MeshData makeTerrain(int cells, btScalar size)
{
    Random random(1);
    MeshData data;
    for (int z = 0; z <= cells; ++z)
    {
        for (int x = 0; x <= cells; ++x)
        {
            const btScalar along = size * btScalar(x), across = size * btScalar(z);
            const btScalar bump = size * btScalar(random.between(-0.1f, 0.1f));
            data.add(btVector3(along, 2 * btSin(along * btScalar(0.3)) * btCos(across * btScalar(0.2)) + bump,
                               across));
        }
    }
    for (int z = 0; z < cells; ++z)
    {
        for (int x = 0; x < cells; ++x)
        {
            for (const int offset : {0, cells + 1, 1, 1, cells + 1, cells + 2})
                data.indices.push_back(z * (cells + 1) + x + offset);
        }
    }
    return data;
}

/// One kind of query: `bullet(i)` and `prepared(i)` answer query i and return the fraction of the closest hit.
template <class Bullet, class Prepared>
void compare(const char* name, int queries, const Bullet& bullet, const Prepared& prepared)
{
    constexpr int kRounds = 11, kTurn = 20;
    std::vector<double> ofBullet, ofPrepared, ratios;
    int different = 0;
    for (int round = 0; round < kRounds; ++round)
    {
        double a = 0, b = 0;
        for (int first = 0; first < queries; first += kTurn)
        {
            const int end = std::min(first + kTurn, queries);
            btScalar fractions[2][kTurn];
            a += timeOf(
                [&]
                {
                    for (int i = first; i < end; ++i)
                        fractions[0][i - first] = bullet(i);
                });
            b += timeOf(
                [&]
                {
                    for (int i = first; i < end; ++i)
                        fractions[1][i - first] = prepared(i);
                });
            for (int i = first; i < end && round == 0; ++i)
                different += fractions[0][i - first] != fractions[1][i - first] ? 1 : 0;
        }
        ofBullet.push_back(a / queries);
        ofPrepared.push_back(b / queries);
        ratios.push_back(a / b);
    }
    std::printf("  %-18s Bullet %8.2f us, prepared %8.2f us, %5.1f times; %d of %d differ\n", name,
                median(ofBullet), median(ofPrepared), median(ratios), different, queries);
}

struct Path
{
    btVector3 from, to;
};

/// Paths over the middle of the terrain.
std::vector<Path> makePaths(int count, btScalar extent, btScalar height, const btVector3& down,
                            btScalar sideways)
{
    Random random(2);
    std::vector<Path> paths;
    for (int i = 0; i < count; ++i)
    {
        const float x = random.between(0.15f, 0.85f);
        const float z = random.between(0.15f, 0.85f);
        const btVector3 from(extent * btScalar(x), height, extent * btScalar(z));
        btVector3 aside = randomVector(random, 1.0f) * sideways;
        aside.setY(0);
        paths.push_back({from, from + down + aside});
    }
    return paths;
}

void compareRays(const char* name, const QueryWorld& scene, const std::vector<Path>& paths)
{
    const auto path = [&](int i) { return paths[static_cast<std::size_t>(i)]; };
    compare(
        name, static_cast<int>(paths.size()),
        [&](int i)
        {
            btCollisionWorld::ClosestRayResultCallback callback(path(i).from, path(i).to);
            scene.world.rayTest(path(i).from, path(i).to, callback);
            return callback.m_closestHitFraction;
        },
        [&](int i)
        {
            btCollisionWorld::ClosestRayResultCallback callback(path(i).from, path(i).to);
            rayTest(scene.world, path(i).from, path(i).to, callback);
            return callback.m_closestHitFraction;
        });
}

void compareSweeps(const char* name, const QueryWorld& scene, const btConvexShape& shape,
                   const std::vector<Path>& paths)
{
    const auto pose = [](const btVector3& at) { return btTransform(btQuaternion::getIdentity(), at); };
    const auto path = [&](int i) { return paths[static_cast<std::size_t>(i)]; };
    compare(
        name, static_cast<int>(paths.size()),
        [&](int i)
        {
            btCollisionWorld::ClosestConvexResultCallback callback(path(i).from, path(i).to);
            scene.world.convexSweepTest(&shape, pose(path(i).from), pose(path(i).to), callback);
            return callback.m_closestHitFraction;
        },
        [&](int i)
        {
            btCollisionWorld::ClosestConvexResultCallback callback(path(i).from, path(i).to);
            convexSweepTest(scene.world, shape, pose(path(i).from), pose(path(i).to), callback);
            return callback.m_closestHitFraction;
        });
}

void compareOn(int cells, btScalar size, bool isQuantized)
{
    QueryWorld scene(makeTerrain(cells, size), isQuantized);
    const PreparedMesh prepared = prepare(scene.shape, 0);
    scene.place(btTransform::getIdentity());
    const btScalar extent = size * btScalar(cells);
    std::printf("%d triangles of %.1f m, %s, %.1f bytes a triangle\n", scene.data().triangleCount(),
                double(size), isQuantized ? "quantized" : "not quantized",
                double(prepared.bytes()) / scene.data().triangleCount());
    compareRays("rays, slanted", scene, makePaths(1000, extent, 10, btVector3(0, -20, 0), 10));
    compareRays("rays, grazing", scene, makePaths(1000, extent, 3, btVector3(0, -3, 0), 30));
    compareRays("rays, straight", scene, makePaths(1000, extent, 10, btVector3(0, -20, 0), 0));
    const int sweeps = size < btScalar(0.2) ? 20 : 100;
    const std::vector<Path> paths = makePaths(sweeps, extent, 6, btVector3(0, -8, 0), 9);
    const btScalar half = btScalar(0.5);
    btConvexHullShape hull;
    Random random(3);
    for (int i = 0; i < 64; ++i)
        hull.addPoint(randomVector(random, 1.0f).normalized() * half);
    compareSweeps("sweeps, sphere", scene, btSphereShape(half), paths);
    compareSweeps("sweeps, box", scene, btBoxShape(btVector3(half, half, half)), paths);
    compareSweeps("sweeps, hull of 64", scene, hull, paths);
}
}  // namespace
}  // namespace cullet::test

int main(int argc, char** argv)
{
    const int cells = argc > 1 ? std::atoi(argv[1]) : 224;
    for (const double size : {0.5, 0.1})
    {
        cullet::test::compareOn(cells, btScalar(size), true);
        cullet::test::compareOn(cells, btScalar(size), false);
    }
    return 0;
}
