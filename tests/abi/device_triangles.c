/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Triangles in the memory of a GPU: the pairs against those of their boxes, each with each, and what goes wrong on purpose.
 * Without a GPU it does nothing, or fails with CULLET_REQUIRE_GPU=1 in the environment. */
#include <cuda_runtime_api.h>

#include "check.h"
#include "check_device.h"
#include <cullet/cullet.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    kTriangles = 1500,
    kMeshes = 2,
    kMostPairs = kTriangles * kTriangles
};

/* Triangle k has the vertices 2k, 2k + 1 and 2k + 2: one in common with the next. */
static float vertices[kMeshes][2 * kTriangles + 1][3];
static uint32_t indices[kTriangles][3];
static float* deviceVertices[kMeshes];
static uint32_t* deviceIndices = NULL;
static cullet_pair expected[kMostPairs], found[kMostPairs];

static void placeVertices(void)
{
    for (int mesh = 0; mesh < kMeshes; ++mesh)
    {
        for (int i = 0; i < 2 * kTriangles + 1; ++i)
        {
            const float centre = 0.02f * (float)i;
            for (int axis = 0; axis < 3; ++axis)
                vertices[mesh][i][axis] = between(0, 3) + (axis == 0 ? centre : 0);
        }
        vertices[mesh][300][1] = NAN;
        CHECK(cudaMemcpy(deviceVertices[mesh], vertices[mesh], sizeof(vertices[mesh]),
                         cudaMemcpyHostToDevice) == cudaSuccess);
    }
    CHECK(cudaDeviceSynchronize() == cudaSuccess);
}

static cullet_device_mesh meshOf(int mesh)
{
    cullet_device_mesh device = {
        sizeof(device), 2 * kTriangles + 1, deviceVertices[mesh], 0, deviceIndices, 0, kTriangles, 0};
    return device;
}

/* Whether a triangle has a box, from low to high. */
static int findBox(int mesh, int triangle, float low[3], float high[3])
{
    for (int axis = 0; axis < 3; ++axis)
    {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
        for (int corner = 0; corner < 3; ++corner)
        {
            const float value = vertices[mesh][indices[triangle][corner]][axis];
            if (!isfinite(value))
                return 0;
            low[axis] = fminf(low[axis], value);
            high[axis] = fmaxf(high[axis], value);
        }
    }
    return 1;
}

static int overlap(int meshA, int a, int meshB, int b)
{
    float low[2][3], high[2][3];
    if (!findBox(meshA, a, low[0], high[0]) || !findBox(meshB, b, low[1], high[1]))
        return 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        if (low[0][axis] > high[1][axis] || low[1][axis] > high[0][axis])
            return 0;
    }
    return 1;
}

/* The pairs of two meshes, or those of one mesh that are no neighbours. */
static uint64_t findExpected(int meshA, int meshB)
{
    uint64_t count = 0;
    for (uint32_t a = 0; a < kTriangles; ++a)
    {
        for (uint32_t b = meshA == meshB ? a + 2 : 0; b < kTriangles; ++b)
        {
            if (overlap(meshA, (int)a, meshB, (int)b))
            {
                expected[count].first = a;
                expected[count++].second = b;
            }
        }
    }
    return count;
}

static void checkSame(const char* what, cullet_triangle_trees* trees, int meshA, int meshB)
{
    cullet_pairs pairs = {NULL, 0};
    uint64_t invalid = 0;
    CHECK(cullet_triangle_trees_collect(trees, &pairs, &invalid) == CULLET_OK);
    const uint64_t count = findExpected(meshA, meshB);
    printf("%s: %llu pairs, %llu on the CPU\n", what, (unsigned long long)pairs.count,
           (unsigned long long)count);
    CHECK(pairs.count == count && count > 10000);
    CHECK(invalid == (meshA == meshB ? 2u : 4u));
    if (pairs.count != count)
        return;
    CHECK(cudaMemcpy(found, pairs.data, count * sizeof(cullet_pair), cudaMemcpyDeviceToHost) == cudaSuccess);
    CHECK(memcmp(found, expected, count * sizeof(cullet_pair)) == 0);
}

static void testPairs(void)
{
    cullet_triangle_trees* trees = NULL;
    CHECK(cullet_triangle_trees_create(NULL, &trees) == CULLET_OK);
    for (int frame = 0; frame < 3; ++frame)
    {
        placeVertices();
        for (int mesh = 0; mesh < kMeshes; ++mesh)
        {
            const cullet_device_mesh device = meshOf(mesh);
            CHECK((frame == 0 ? cullet_triangle_trees_build : cullet_triangle_trees_refit)(
                      trees, (uint32_t)mesh, &device) == CULLET_OK);
        }
        CHECK(cullet_triangle_trees_enqueue_pairs(trees, 0, 1) == CULLET_OK);
        checkSame("two meshes", trees, 0, 1);
        CHECK(cullet_triangle_trees_enqueue_own_pairs(trees, 1, CULLET_OWN_PAIRS_WITHOUT_NEIGHBOURS) ==
              CULLET_OK);
        checkSame("one mesh", trees, 1, 1);
    }
    cullet_triangle_trees_destroy(trees);
}

static void testBadCalls(void)
{
    cullet_triangle_trees* trees = NULL;
    cullet_pairs pairs = {NULL, 7};
    cullet_device_mesh mesh = meshOf(0);
    CHECK(cullet_triangle_trees_create(NULL, &trees) == CULLET_OK);
    CHECK(cullet_triangle_trees_collect(trees, &pairs, NULL) == CULLET_ERROR_ARGUMENT && pairs.count == 7);
    CHECK(cullet_triangle_trees_build(trees, 2, &mesh) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_triangle_trees_build(trees, 0, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_refit(NULL, 0, &mesh) == CULLET_ERROR_NULL);
    mesh.vertices = NULL;
    CHECK(cullet_triangle_trees_build(trees, 0, &mesh) == CULLET_ERROR_NULL);
    mesh = meshOf(0);
    mesh.triangle_count = 1u << 31;
    CHECK(cullet_triangle_trees_build(trees, 0, &mesh) == CULLET_ERROR_ARGUMENT);
    mesh.size = 4;
    CHECK(cullet_triangle_trees_build(trees, 0, &mesh) == CULLET_ERROR_SIZE);
    CHECK(cullet_triangle_trees_enqueue_pairs(trees, 0, 2) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_triangle_trees_enqueue_pairs(trees, 2, 0) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_triangle_trees_enqueue_own_pairs(trees, 2, 0) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_triangle_trees_enqueue_own_pairs(trees, 0, 2) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_triangle_trees_enqueue_pairs(trees, 0, 1) == CULLET_OK);
    CHECK(cullet_triangle_trees_collect(trees, NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_collect(trees, &pairs, NULL) == CULLET_OK && pairs.count == 0);
    cullet_triangle_trees_destroy(trees);
    cullet_triangle_trees_destroy(NULL);
}

static void testBadOptions(void)
{
    cullet_triangle_trees_options options = {sizeof(options), -1, NULL, 0, 0};
    cullet_triangle_trees* trees = NULL;
    CHECK(cullet_triangle_trees_create(&options, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_create(&options, &trees) == CULLET_ERROR_ARGUMENT);
    options.device = 4096;
    CHECK(cullet_triangle_trees_create(&options, &trees) == CULLET_ERROR_NO_DEVICE);
    CHECK(strlen(cullet_last_error()) > 0);
    options.device = 0;
    options.trees = 65537;
    CHECK(cullet_triangle_trees_create(&options, &trees) == CULLET_ERROR_ARGUMENT);
    options.size = 4;
    CHECK(cullet_triangle_trees_create(&options, &trees) == CULLET_ERROR_SIZE);
    CHECK(trees == NULL);
}

static cullet_triangle_trees* lateTrees = NULL;

static void destroyLate(void)
{
    cullet_triangle_trees_destroy(lateTrees);
}

/* What is destroyed after main(), when the CUDA runtime has gone: a crash there is the exit status of this program. */
static void testLateEnd(void)
{
    const cullet_device_mesh mesh = meshOf(0);
    CHECK(cullet_triangle_trees_create(NULL, &lateTrees) == CULLET_OK);
    CHECK(cullet_triangle_trees_build(lateTrees, 0, &mesh) == CULLET_OK);
    CHECK(cullet_triangle_trees_enqueue_own_pairs(lateTrees, 0, CULLET_OWN_PAIRS_WITHOUT_NEIGHBOURS) ==
          CULLET_OK);
    checkSame("until the end", lateTrees, 0, 0);
}

int main(void)
{
    /* Before the first call of CUDA, whose own handlers then run earlier. */
    atexit(destroyLate);
    if (!hasDevice())
        return isDeviceRequired() ? EXIT_FAILURE : EXIT_SUCCESS;
    for (uint32_t i = 0; i < 3 * kTriangles; ++i)
        indices[i / 3][i % 3] = i / 3 * 2 + i % 3;
    CHECK(cudaMalloc((void**)&deviceIndices, sizeof(indices)) == cudaSuccess);
    CHECK(cudaMemcpy(deviceIndices, indices, sizeof(indices), cudaMemcpyHostToDevice) == cudaSuccess);
    for (int mesh = 0; mesh < kMeshes; ++mesh)
        CHECK(cudaMalloc((void**)&deviceVertices[mesh], sizeof(vertices[mesh])) == cudaSuccess);
    testPairs();
    testBadCalls();
    testBadOptions();
    testLateEnd();
    CHECK(cudaGetLastError() == cudaSuccess);
    return finish("device_triangles");
}
