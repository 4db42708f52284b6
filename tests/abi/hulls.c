/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Hull queries of the C interface, from C: cubes whose distances are known, and what goes wrong on purpose. */
#include "check.h"
#include <cullet/cullet.h>
#include <math.h>
#include <string.h>

static const cullet_pose kInPlace = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};

/* A cube with corners at +-1 and a point inside. */
static cullet_hull* makeCube(void)
{
    double points[9][4];
    cullet_hull* cube = NULL;
    for (int i = 0; i < 9; ++i)
    {
        for (int axis = 0; axis < 3; ++axis)
            points[i][axis] = i == 8 ? 0.1 : ((i >> axis) & 1 ? 1 : -1);
    }
    CHECK(cullet_hull_create(points[0], sizeof(points[0]), 9, &cube) == CULLET_OK);
    CHECK(cullet_hull_vertex_count(cube) == 8);
    return cube;
}

static cullet_hull_result emptyResult(void)
{
    cullet_hull_result result;
    memset(&result, 0, sizeof(result));
    result.size = sizeof(result);
    return result;
}

static int isNear(double a, double b)
{
    return fabs(a - b) < 1e-12;
}

static void checkApart(const cullet_hull* cube, const cullet_pose* pose, cullet_hull_cache* cache)
{
    const double gap = pose->origin[0] - 2;
    cullet_hull_result result = emptyResult();
    CHECK(cullet_hull_distance(cube, &kInPlace, cube, pose, INFINITY, cache, &result) == CULLET_OK);
    CHECK(result.state == CULLET_NEAR && isNear(result.distance, gap) && isNear(result.axis[0], -1));
    CHECK(isNear(result.point_a[0], 1) && isNear(result.point_b[0], pose->origin[0] - 1));
    for (int i = 0; i < 3; ++i)
        CHECK(isNear(result.point_a[i] - result.point_b[i], result.distance * result.axis[i]));
    result = emptyResult();
    CHECK(cullet_hull_distance(cube, NULL, cube, pose, gap / 2, cache, &result) == CULLET_OK);
    CHECK(result.state == CULLET_SEPARATED && result.distance == 0 && result.axis[0] < 0);
    result = emptyResult();
    CHECK(cullet_hull_penetration(cube, NULL, cube, pose, cache, &result) == CULLET_OK);
    CHECK(result.state == CULLET_SEPARATED && result.distance == 0);
}

static void checkOverlapping(const cullet_hull* cube, const cullet_pose* pose, cullet_hull_cache* cache)
{
    const double depth = 2 - pose->origin[0];
    cullet_hull_result result = emptyResult();
    CHECK(cullet_hull_distance(cube, NULL, cube, pose, INFINITY, cache, &result) == CULLET_OK);
    CHECK(result.state == CULLET_OVERLAPPING && result.distance == 0);
    result = emptyResult();
    CHECK(cullet_hull_penetration(cube, NULL, cube, pose, cache, &result) == CULLET_OK);
    CHECK(result.state == CULLET_OVERLAPPING && fabs(result.distance + depth) < 1e-6);
    CHECK(fabs(result.axis[0] + 1) < 1e-6);
    CHECK(fabs(result.point_a[0] - result.point_b[0] - depth) < 1e-6);
}

/* Between a cube in place and one moved, most along x. */
static void testMovedCubes(const cullet_hull* cube, cullet_hull_cache* cache)
{
    int apartCount = 0, overlappingCount = 0;
    for (int step = 0; step < 400; ++step)
    {
        cullet_pose pose = kInPlace;
        pose.origin[0] = between(1.1f, 3);
        pose.origin[1] = between(-1, 1);
        pose.origin[2] = between(-0.4f, 0.4f);
        int32_t overlaps = -1;
        double axis[3];
        CHECK(cullet_hull_overlap(cube, NULL, cube, &pose, cache, &overlaps, axis) == CULLET_OK);
        CHECK(overlaps == (pose.origin[0] <= 2));
        CHECK(overlaps ? axis[0] == 0 : axis[0] < 0);
        if (pose.origin[0] > 2.001)
        {
            ++apartCount;
            checkApart(cube, &pose, cache);
        }
        else if (pose.origin[0] < 1.999)
        {
            ++overlappingCount;
            checkOverlapping(cube, &pose, cache);
        }
    }
    CHECK(apartCount > 100 && overlappingCount > 100);
}

/* A cube turned by an eighth about z, far from the origin: its edge looks along x. */
static void testTurnedCube(const cullet_hull* cube)
{
    const double c = sqrt(0.5);
    const cullet_pose turned = {{c, -c, 0, c, c, 0, 0, 0, 1}, {1003, 7, 0}};
    const cullet_pose other = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {1000, 7, 0}};
    cullet_hull_result result = emptyResult();
    CHECK(cullet_hull_distance(cube, &turned, cube, &other, 10, NULL, &result) == CULLET_OK);
    CHECK(result.state == CULLET_NEAR && isNear(result.distance, 2 - sqrt(2)));
    CHECK(isNear(result.point_b[0], 1001) && isNear(result.point_a[1], 7));
}

/* A point, a segment and a triangle are hulls, too. */
static void testFlatHulls(const cullet_hull* cube)
{
    const double points[9] = {3, 0, 0, 3, 1, 0, 3, 0, 1};
    for (uint32_t count = 1; count <= 3; ++count)
    {
        cullet_hull* flat = NULL;
        CHECK(cullet_hull_create(points, 0, count, &flat) == CULLET_OK);
        CHECK(cullet_hull_vertex_count(flat) == count);
        cullet_hull_result result = emptyResult();
        CHECK(cullet_hull_distance(flat, NULL, cube, NULL, INFINITY, NULL, &result) == CULLET_OK);
        CHECK(isNear(result.distance, 2) && isNear(result.axis[0], 1));
        cullet_hull_destroy(flat);
    }
}

static void testErrors(const cullet_hull* cube)
{
    const double points[6] = {0, 0, 0, 1, NAN, 0};
    const double huge[6] = {0, 0, 0, 1, 1e61, 0};
    cullet_pose pose = kInPlace;
    cullet_hull* hull = NULL;
    int32_t overlaps = -1;
    cullet_hull_result result = emptyResult();
    CHECK(cullet_hull_create(points, 0, 2, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_create(NULL, 0, 2, &hull) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_create(points, 8, 2, &hull) == CULLET_ERROR_SIZE);
    CHECK(cullet_hull_create(points, SIZE_MAX - 23, 2, &hull) == CULLET_ERROR_SIZE);
    CHECK(cullet_hull_create(points, 0, 0, &hull) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_hull_create(points, 0, 2, &hull) == CULLET_ERROR_NOT_FINITE && hull == NULL);
    CHECK(cullet_hull_create(huge, 0, 2, &hull) == CULLET_ERROR_NOT_FINITE && hull == NULL);
    CHECK(cullet_hull_vertex_count(NULL) == 0);
    CHECK(cullet_hull_cache_create(NULL) == CULLET_ERROR_NULL);

    CHECK(cullet_hull_overlap(NULL, NULL, cube, NULL, NULL, &overlaps, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_overlap(cube, NULL, cube, NULL, NULL, NULL, NULL) == CULLET_ERROR_NULL);
    pose.origin[1] = INFINITY;
    CHECK(cullet_hull_overlap(cube, &pose, cube, NULL, NULL, &overlaps, NULL) == CULLET_ERROR_NOT_FINITE);
    pose = kInPlace;
    pose.basis[4] = 0;
    CHECK(cullet_hull_overlap(cube, NULL, cube, &pose, NULL, &overlaps, NULL) == CULLET_ERROR_ARGUMENT);
    CHECK(overlaps == -1);
    CHECK(cullet_hull_overlap(cube, NULL, cube, NULL, NULL, &overlaps, NULL) == CULLET_OK && overlaps == 1);

    CHECK(cullet_hull_distance(cube, NULL, cube, NULL, -1, NULL, &result) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_hull_distance(cube, NULL, cube, NULL, NAN, NULL, &result) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_hull_distance(cube, NULL, NULL, NULL, 1, NULL, &result) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_distance(cube, NULL, cube, NULL, 1, NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_penetration(cube, NULL, NULL, NULL, NULL, &result) == CULLET_ERROR_NULL);
    result.size = 12;
    CHECK(cullet_hull_distance(cube, NULL, cube, NULL, 1, NULL, &result) == CULLET_ERROR_SIZE);
    CHECK(cullet_hull_penetration(cube, NULL, cube, NULL, NULL, &result) == CULLET_ERROR_SIZE);
    cullet_hull_destroy(NULL);
    cullet_hull_cache_destroy(NULL);
}

/* What is checked before a device is asked for; without one there is no finder. */
static void testContactFinder(const cullet_hull* cube)
{
    cullet_contact_finder_options options = {sizeof(options), -1, NULL};
    cullet_contact_finder* finder = NULL;
    cullet_contacts contacts = {0};
    cullet_hull* huge = NULL;
    const cullet_hull* list[2] = {cube, NULL};
    const double far[3] = {1e50, 0, 0};
    CHECK(cullet_contact_finder_create(list, 1, &options, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_create(list, 1, &options, &finder) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_contact_finder_create(list, 2, NULL, &finder) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_create(NULL, 2, NULL, &finder) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_create(far, 0, 1, &huge) == CULLET_OK);
    list[1] = huge;
    CHECK(cullet_contact_finder_create(list, 2, NULL, &finder) == CULLET_ERROR_NOT_FINITE);
    cullet_hull_destroy(huge);
    options.device = 4096;
    CHECK(cullet_contact_finder_create(list, 1, &options, &finder) == CULLET_ERROR_NO_DEVICE);
    CHECK(strlen(cullet_last_error()) > 0);
    options.size = 4;
    CHECK(cullet_contact_finder_create(list, 1, &options, &finder) == CULLET_ERROR_SIZE);
    CHECK(finder == NULL);
    contacts.size = sizeof(contacts);
    CHECK(cullet_contact_finder_enqueue(NULL, NULL, 0, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_ahead(NULL, &contacts) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_collect(NULL, &contacts) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_forget(NULL) == CULLET_ERROR_NULL);
    cullet_contact_finder_destroy(NULL);
}

int main(void)
{
    cullet_hull* cube = makeCube();
    cullet_hull_cache* cache = NULL;
    CHECK(cullet_hull_cache_create(&cache) == CULLET_OK);
    testMovedCubes(cube, cache);
    testMovedCubes(cube, NULL);
    testTurnedCube(cube);
    testFlatHulls(cube);
    testErrors(cube);
    testContactFinder(cube);
    cullet_hull_cache_destroy(cache);
    cullet_hull_destroy(cube);
    return finish("hulls");
}
