/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Bodies in the memory of a GPU: pairs and answers against those of the CPU's hulls, each with each, and what goes wrong on
 * purpose. Without a GPU it does nothing, or fails with CULLET_REQUIRE_GPU=1 in the environment. */
#include <cuda_runtime_api.h>

#include "check.h"
#include "check_device.h"
#include <cullet/cullet.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    kBodies = 300,
    kHulls = 3,
    kPoints = 24
};

static cullet_hull* hulls[kHulls];
static cullet_device_pose poses[kBodies];
static cullet_device_pose* devicePoses = NULL;

static void makeHulls(void)
{
    for (int hull = 0; hull < kHulls; ++hull)
    {
        double points[kPoints][3];
        for (int i = 0; i < kPoints; ++i)
        {
            for (int axis = 0; axis < 3; ++axis)
                points[i][axis] = between(-1, 1);
        }
        CHECK(cullet_hull_create(points[0], 0, kPoints, &hulls[hull]) == CULLET_OK);
    }
}

static void placeBodies(void)
{
    for (int body = 0; body < kBodies; ++body)
    {
        cullet_device_pose* pose = &poses[body];
        float length2 = 0;
        for (int axis = 0; axis < 3; ++axis)
            pose->position[axis] = between(0, 9);
        pose->hull = (uint32_t)body % kHulls;
        for (int k = 0; k < 4; ++k)
        {
            pose->rotation[k] = between(-1, 1);
            length2 += pose->rotation[k] * pose->rotation[k];
        }
        for (int k = 0; k < 4; ++k)
            pose->rotation[k] /= sqrtf(length2);
    }
    /* Has no pairs. */
    poses[7].rotation[1] = NAN;
}

static void uploadBodies(void)
{
    CHECK(cudaMemcpy(devicePoses, poses, sizeof(poses), cudaMemcpyHostToDevice) == cudaSuccess);
    CHECK(cudaDeviceSynchronize() == cudaSuccess);
}

/* In double, of a quaternion of any length. */
static cullet_pose poseOf(int body)
{
    const cullet_device_pose* from = &poses[body];
    const double x = from->rotation[0], y = from->rotation[1], z = from->rotation[2], w = from->rotation[3];
    const double two = 2 / (x * x + y * y + z * z + w * w);
    const cullet_pose pose = {{1 - two * (y * y + z * z), two * (x * y - z * w), two * (x * z + y * w),
                               two * (x * y + z * w), 1 - two * (x * x + z * z), two * (y * z - x * w),
                               two * (x * z - y * w), two * (y * z + x * w), 1 - two * (x * x + y * y)},
                              {from->position[0], from->position[1], from->position[2]}};
    return pose;
}

static double distanceOf(int a, int b)
{
    const cullet_pose poseA = poseOf(a), poseB = poseOf(b);
    cullet_hull_result result = {0};
    result.size = sizeof(result);
    CHECK(cullet_hull_distance(hulls[poses[a].hull], &poseA, hulls[poses[b].hull], &poseB, INFINITY, NULL,
                               &result) == CULLET_OK);
    return result.distance;
}

static double penetrationOf(int a, int b)
{
    const cullet_pose poseA = poseOf(a), poseB = poseOf(b);
    cullet_hull_result result = {0};
    result.size = sizeof(result);
    CHECK(cullet_hull_penetration(hulls[poses[a].hull], &poseA, hulls[poses[b].hull], &poseB, NULL,
                                  &result) == CULLET_OK);
    return -result.distance;
}

/* The answers of one frame, on the CPU. */
static cullet_pair pairs[kBodies * kBodies];
static uint8_t states[kBodies * kBodies];
static float distances[kBodies * kBodies][8];
static uint32_t overlaps[kBodies * kBodies];
static float depths[kBodies * kBodies][8];
static float patches[kBodies * kBodies][20];

static void download(const cullet_contacts* found)
{
    const size_t count = found->count;
    CHECK(count < kBodies * kBodies);
    CHECK(cudaMemcpy(pairs, found->pairs, count * sizeof(pairs[0]), cudaMemcpyDeviceToHost) == cudaSuccess);
    CHECK(cudaMemcpy(states, found->states, count, cudaMemcpyDeviceToHost) == cudaSuccess);
    CHECK(cudaMemcpy(distances, found->distances, count * sizeof(distances[0]), cudaMemcpyDeviceToHost) ==
          cudaSuccess);
    CHECK(cudaMemcpy(overlaps, found->overlaps, found->overlapping * sizeof(overlaps[0]),
                     cudaMemcpyDeviceToHost) == cudaSuccess);
    CHECK(cudaMemcpy(depths, found->depths, found->overlapping * sizeof(depths[0]), cudaMemcpyDeviceToHost) ==
          cudaSuccess);
    CHECK(cudaMemcpy(patches, found->contacts, found->overlapping * sizeof(patches[0]),
                     cudaMemcpyDeviceToHost) == cudaSuccess);
}

static int isBefore(cullet_pair a, cullet_pair b)
{
    return a.first < b.first || (a.first == b.first && a.second < b.second);
}

/* Each pair of bodies has its answer; boxes of a pair are never farther apart than the hulls. */
static void checkAnswers(const cullet_contacts* found)
{
    uint64_t next = 0;
    uint32_t overlapping = 0;
    for (uint32_t a = 0; a < kBodies; ++a)
    {
        for (uint32_t b = a + 1; b < kBodies; ++b)
        {
            const cullet_pair pair = {a, b};
            const int isListed = next < found->count && !isBefore(pair, pairs[next]);
            const int isBad = a == 7 || b == 7;
            const double distance = isBad ? 1 : distanceOf((int)a, (int)b);
            CHECK(!isListed || (pairs[next].first == a && pairs[next].second == b && !isBad));
            CHECK(isListed || distance > 0);
            if (!isListed)
                continue;
            CHECK(states[next] == (distance > 0 ? CULLET_PAIR_APART : CULLET_PAIR_OVERLAPPING) ||
                  fabs(distance) < 1e-5);
            CHECK(fabs(distances[next][3] - fmax(distance, 0)) < 1e-5);
            if (states[next] == CULLET_PAIR_OVERLAPPING)
            {
                uint32_t points = 0;
                CHECK(overlapping < found->overlapping && overlaps[overlapping] == next);
                CHECK(fabs(depths[overlapping][3] - penetrationOf((int)a, (int)b)) < 1e-4);
                memcpy(&points, &patches[overlapping][3], sizeof(points));
                CHECK(points >= 1 && points <= 4);
                CHECK(fabs(patches[overlapping][7] - depths[overlapping][3]) <=
                      1.01e-3 * depths[overlapping][3] + 1e-6);
                ++overlapping;
            }
            ++next;
        }
    }
    printf("%llu pairs, %u overlap\n", (unsigned long long)found->count, found->overlapping);
    CHECK(next == found->count && overlapping == found->overlapping);
    CHECK(overlapping > 100 && found->count > (uint64_t)overlapping + 100);
}

static void testFrames(void)
{
    cullet_contact_finder* finder = NULL;
    cullet_contact_query query = {sizeof(query), CULLET_TOUCHING_CONTACTS, 0.05f, INFINITY, 0.01f, 0};
    CHECK(cullet_contact_finder_create((const cullet_hull* const*)hulls, kHulls, NULL, &finder) == CULLET_OK);
    uint64_t last = 0;
    for (int frame = 0; frame < 3; ++frame)
    {
        cullet_contacts ahead = {0}, found = {0};
        ahead.size = found.size = sizeof(found);
        placeBodies();
        uploadBodies();
        CHECK(cullet_contact_finder_enqueue(finder, devicePoses, kBodies, &query) == CULLET_OK);
        CHECK(cullet_contact_finder_ahead(finder, &ahead) == CULLET_OK);
        CHECK(ahead.pairs != NULL && ahead.device_count != NULL && ahead.device_overlapping != NULL);
        CHECK(cullet_contact_finder_collect(finder, &found) == CULLET_OK);
        CHECK(found.count == last + found.added - found.removed);
        last = found.count;
        uint64_t onDevice = 0;
        CHECK(cudaMemcpy(&onDevice, found.device_count, sizeof(onDevice), cudaMemcpyDeviceToHost) ==
              cudaSuccess);
        CHECK(onDevice == found.count);
        download(&found);
        checkAnswers(&found);
    }
    cullet_contact_finder_destroy(finder);
}

static void testBadCalls(void)
{
    cullet_contact_finder* finder = NULL;
    cullet_contact_query query = {sizeof(query), 4, 0, 0, 0, 0};
    cullet_contacts contacts = {0};
    contacts.size = sizeof(contacts);
    CHECK(cullet_contact_finder_create((const cullet_hull* const*)hulls, kHulls, NULL, &finder) == CULLET_OK);
    CHECK(cullet_contact_finder_collect(finder, &contacts) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_contact_finder_ahead(finder, &contacts) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_contact_finder_enqueue(finder, NULL, 1, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_enqueue(NULL, devicePoses, 1, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1u << 31, NULL) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_ARGUMENT);
    query.touching = CULLET_TOUCHING_CONTACTS;
    query.contact_margin = -1;
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_ARGUMENT);
    query.contact_margin = 0;
    query.reserved = 1;
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_ARGUMENT);
    query.reserved = 0;
    query.margin = -1;
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_ARGUMENT);
    query.margin = INFINITY;
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_ARGUMENT);
    query.margin = 0;
    query.max_distance = NAN;
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_ARGUMENT);
    query.size = 4;
    CHECK(cullet_contact_finder_enqueue(finder, devicePoses, 1, &query) == CULLET_ERROR_SIZE);
    CHECK(cullet_contact_finder_enqueue(finder, NULL, 0, NULL) == CULLET_OK);
    CHECK(cullet_contact_finder_collect(finder, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_collect(finder, &contacts) == CULLET_OK && contacts.count == 0);
    CHECK(contacts.distances == NULL && contacts.overlaps == NULL && contacts.depths == NULL);
    CHECK(cullet_contact_finder_ahead(finder, &contacts) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_contact_finder_forget(NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_contact_finder_forget(finder) == CULLET_OK);
    CHECK(cullet_contact_finder_collect(finder, &contacts) == CULLET_ERROR_ARGUMENT);
    cullet_contact_finder_destroy(finder);
}

int main(void)
{
    if (!hasDevice())
        return isDeviceRequired() ? EXIT_FAILURE : EXIT_SUCCESS;
    makeHulls();
    CHECK(cudaMalloc((void**)&devicePoses, sizeof(poses)) == cudaSuccess);
    testFrames();
    testBadCalls();
    CHECK(cudaGetLastError() == cudaSuccess);
    for (int hull = 0; hull < kHulls; ++hull)
        cullet_hull_destroy(hulls[hull]);
    return finish("device_contacts");
}
