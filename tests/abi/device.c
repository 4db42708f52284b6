/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Boxes in the memory of a GPU, as a C program with a CUDA runtime of its own has them: the pairs against those of a box
 * set on the CPU, and what goes wrong on purpose. Without a GPU it does nothing, or fails with CULLET_REQUIRE_GPU=1 in the environment. */
#include <cuda_runtime_api.h>

#include "check.h"
#include "check_device.h"
#include <cullet/cullet.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    kMostBoxes = 20000
};

typedef struct PairList
{
    cullet_pair* data;
    uint64_t count;
} PairList;

static float boxes[kMostBoxes][6];
static float* deviceBoxes = NULL;

static void placeBoxes(uint32_t count, float side, float largest)
{
    for (uint32_t i = 0; i < count; ++i)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            boxes[i][axis] = between(0, side);
            boxes[i][axis + 3] = boxes[i][axis] + between(0, largest);
        }
    }
}

static int comparePairs(const void* a, const void* b)
{
    const cullet_pair *p = a, *q = b;
    if (p->first != q->first)
        return p->first < q->first ? -1 : 1;
    return (p->second > q->second) - (p->second < q->second);
}

/* What the CPU finds, as indices of boxes. */
static PairList findOnHost(uint32_t count)
{
    const cullet_box_set_options options = {sizeof(options), CULLET_BACKEND_GRID, 1, 0.0f};
    static uint32_t ids[kMostBoxes];
    cullet_box_set* set = NULL;
    cullet_pairs pairs = {NULL, 0};
    CHECK(cullet_box_set_create(&options, &set) == CULLET_OK);
    CHECK(cullet_box_set_add(set, boxes[0], 0, count, ids) >= 0);
    CHECK(cullet_box_set_update(set, NULL, NULL) == CULLET_OK);
    CHECK(cullet_box_set_pairs(set, &pairs) == CULLET_OK);
    PairList list = {malloc((pairs.count + 1) * sizeof(cullet_pair)), pairs.count};
    for (uint64_t i = 0; i < list.count; ++i)
    {
        list.data[i].first = pairs.data[i].first - ids[0];
        list.data[i].second = pairs.data[i].second - ids[0];
    }
    cullet_box_set_destroy(set);
    return list;
}

/* Pairs of the device, brought here, the lower index first, and sorted. */
static PairList download(cullet_pairs pairs)
{
    const size_t bytes = pairs.count * sizeof(cullet_pair);
    PairList list = {malloc(bytes + sizeof(cullet_pair)), pairs.count};
    CHECK(cudaMemcpy(list.data, pairs.data, bytes, cudaMemcpyDeviceToHost) == cudaSuccess);
    for (uint64_t i = 0; i < list.count; ++i)
    {
        const cullet_pair pair = list.data[i];
        if (pair.second < pair.first)
        {
            list.data[i].first = pair.second;
            list.data[i].second = pair.first;
        }
    }
    qsort(list.data, list.count, sizeof(cullet_pair), comparePairs);
    return list;
}

static void checkSame(const char* what, cullet_pairs onDevice, uint32_t count, uint64_t least)
{
    PairList found = download(onDevice), expected = findOnHost(count);
    const int isSame = found.count == expected.count &&
                       memcmp(found.data, expected.data, found.count * sizeof(cullet_pair)) == 0;
    printf("%s: %u boxes, %llu pairs, %llu on the CPU\n", what, count, (unsigned long long)found.count,
           (unsigned long long)expected.count);
    CHECK(isSame);
    CHECK(expected.count >= least);
    free(found.data);
    free(expected.data);
}

static cullet_pairs search(cullet_device_finder* finder, uint32_t count)
{
    cullet_pairs pairs = {NULL, 0};
    CHECK(cullet_device_finder_enqueue(finder, deviceBoxes, count) == CULLET_OK);
    CHECK(cullet_device_finder_collect(finder, &pairs) == CULLET_OK);
    return pairs;
}

static void searchAndCheck(const char* what, cullet_device_finder* finder, uint32_t count, uint64_t least)
{
    CHECK(cudaMemcpy(deviceBoxes, boxes, count * sizeof(boxes[0]), cudaMemcpyHostToDevice) == cudaSuccess);
    CHECK(cudaDeviceSynchronize() == cudaSuccess);
    checkSame(what, search(finder, count), count, least);
}

/* A stream of its own: other numbers of boxes, and the same ones over and over, which is a recorded search. */
static void testSizes(void)
{
    cullet_device_finder* finder = NULL;
    CHECK(cullet_device_finder_create(NULL, &finder) == CULLET_OK);
    placeBoxes(2000, 10.0f, 1.0f);
    searchAndCheck("few", finder, 2000, 500);
    for (int step = 0; step < 4; ++step)
    {
        placeBoxes(kMostBoxes, 30.0f, 1.5f);
        searchAndCheck("many", finder, kMostBoxes, 10000);
    }
    placeBoxes(2000, 0.5f, 1.0f);
    searchAndCheck("more pairs than there was room for", finder, 2000, 500000);
    searchAndCheck("one", finder, 1, 0);
    CHECK(cullet_device_finder_enqueue(finder, NULL, 0) == CULLET_OK);
    cullet_pairs none = {NULL, 1};
    CHECK(cullet_device_finder_collect(finder, &none) == CULLET_OK && none.count == 0);
    cullet_device_finder_destroy(finder);
}

/* Makes a box a point at the upper corner of another. */
static void touchCorner(float* box, const float* other)
{
    memcpy(box, &other[3], 3 * sizeof(float));
    memcpy(&box[3], &other[3], 3 * sizeof(float));
}

/* Boxes that overlap nothing, that have no end, that are a point, and that touch. */
static void testSpecialBoxes(void)
{
    cullet_device_finder* finder = NULL;
    CHECK(cullet_device_finder_create(NULL, &finder) == CULLET_OK);
    placeBoxes(500, 8.0f, 1.0f);
    for (int i = 0; i < 500; i += 5)
    {
        float* box = boxes[i];
        if (i % 25 == 0)
            box[1] = NAN;
        else if (i % 25 == 5)
            box[0] = box[3] + 1.0f;
        else if (i % 25 == 10)
            box[3] = INFINITY;
        else if (i % 25 == 15)
            memcpy(&box[3], box, 3 * sizeof(float));
        else
            touchCorner(box, boxes[i - 1]);
    }
    searchAndCheck("special", finder, 500, 100);
    cullet_device_finder_destroy(finder);
}

/* Copies, search and copies again on a stream of the program, which waits for none of them but in the collect. */
static void testStream(void)
{
    cudaStream_t stream = NULL;
    CHECK(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking) == cudaSuccess);
    const cullet_device_finder_options options = {sizeof(options), 0, stream};
    cullet_device_finder* finder = NULL;
    CHECK(cullet_device_finder_create(&options, &finder) == CULLET_OK);
    for (int step = 0; step < 3; ++step)
    {
        placeBoxes(5000, 16.0f, 1.0f);
        CHECK(cudaMemcpyAsync(deviceBoxes, boxes, 5000 * sizeof(boxes[0]), cudaMemcpyHostToDevice, stream) ==
              cudaSuccess);
        checkSame("a stream of the program", search(finder, 5000), 5000, 1000);
    }
    cullet_device_finder_destroy(finder);
    CHECK(cudaStreamDestroy(stream) == cudaSuccess);
}

/* Pairs stay until the next search of the same finder, whatever others do, and end. */
static void testTwoFinders(void)
{
    cullet_device_finder *first = NULL, *second = NULL;
    CHECK(cullet_device_finder_create(NULL, &first) == CULLET_OK);
    CHECK(cullet_device_finder_create(NULL, &second) == CULLET_OK);
    placeBoxes(3000, 12.0f, 1.0f);
    CHECK(cudaMemcpy(deviceBoxes, boxes, 3000 * sizeof(boxes[0]), cudaMemcpyHostToDevice) == cudaSuccess);
    CHECK(cudaDeviceSynchronize() == cudaSuccess);
    const cullet_pairs pairs = search(first, 3000);
    search(second, 1000);
    cullet_device_finder_destroy(second);
    checkSame("after another finder", pairs, 3000, 500);
    cullet_pairs again = {NULL, 0};
    CHECK(cullet_device_finder_collect(first, &again) == CULLET_OK && again.count == pairs.count);
    cullet_device_finder_destroy(first);
}

static void testBadCalls(void)
{
    cullet_device_finder* finder = NULL;
    cullet_pairs pairs = {NULL, 7};
    CHECK(cullet_device_finder_create(NULL, &finder) == CULLET_OK);
    CHECK(cullet_device_finder_collect(finder, &pairs) == CULLET_ERROR_ARGUMENT && pairs.count == 7);
    CHECK(strstr(cullet_last_error(), "enqueue") != NULL);
    placeBoxes(100, 2.0f, 1.0f);
    searchAndCheck("before errors", finder, 100, 100);
    CHECK(cullet_device_finder_enqueue(finder, NULL, 100) == CULLET_ERROR_NULL);
    CHECK(cullet_device_finder_enqueue(NULL, deviceBoxes, 100) == CULLET_ERROR_NULL);
    CHECK(cullet_device_finder_enqueue(finder, deviceBoxes, 1u << 30) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_device_finder_collect(finder, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_device_finder_collect(NULL, &pairs) == CULLET_ERROR_NULL && pairs.count == 7);
    CHECK(cullet_device_finder_collect(finder, &pairs) == CULLET_OK);
    checkSame("after errors", pairs, 100, 100);
    cullet_device_finder_destroy(finder);
    cullet_device_finder_destroy(NULL);
}

static void testBadOptions(void)
{
    cullet_device_finder_options options = {sizeof(options), -1, NULL};
    cullet_device_finder* finder = NULL;
    CHECK(cullet_device_finder_create(&options, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_device_finder_create(&options, &finder) == CULLET_ERROR_ARGUMENT);
    options.device = 4096;
    CHECK(cullet_device_finder_create(&options, &finder) == CULLET_ERROR_NO_DEVICE);
    CHECK(strlen(cullet_last_error()) > 0);
    options.device = 0;
    options.size = 4;
    CHECK(cullet_device_finder_create(&options, &finder) == CULLET_ERROR_SIZE);
    CHECK(finder == NULL);
}

static cullet_device_finder* lateFinder = NULL;
static cullet_box_set* lateSet = NULL;

static void destroyLate(void)
{
    cullet_device_finder_destroy(lateFinder);
    cullet_box_set_destroy(lateSet);
}

/* What is destroyed after main(), when the CUDA runtime has gone: a crash there is the exit status of this program. */
static void testLateEnd(void)
{
    const cullet_box_set_options options = {sizeof(options), CULLET_BACKEND_CUDA, 0, 0.0f};
    static uint32_t ids[1000];
    cullet_pairs pairs = {NULL, 0};
    placeBoxes(1000, 8.0f, 1.0f);
    CHECK(cullet_device_finder_create(NULL, &lateFinder) == CULLET_OK);
    searchAndCheck("until the end", lateFinder, 1000, 200);
    CHECK(cullet_box_set_create(&options, &lateSet) == CULLET_OK);
    CHECK(cullet_box_set_add(lateSet, boxes[0], 0, 1000, ids) == CULLET_OK);
    CHECK(cullet_box_set_update(lateSet, &pairs, NULL) == CULLET_OK && pairs.count >= 200);
}

int main(void)
{
    /* Before the first call of CUDA, whose own handlers then run earlier. */
    atexit(destroyLate);
    if (!hasDevice())
        return isDeviceRequired() ? EXIT_FAILURE : EXIT_SUCCESS;
    CHECK(cudaMalloc((void**)&deviceBoxes, sizeof(boxes)) == cudaSuccess);
    testSizes();
    testSpecialBoxes();
    testStream();
    testTwoFinders();
    testBadCalls();
    testBadOptions();
    testLateEnd();
    CHECK(cudaGetLastError() == cudaSuccess);
    CHECK(cudaFree(deviceBoxes) == cudaSuccess);
    return finish("device");
}
