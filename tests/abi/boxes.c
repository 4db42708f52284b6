/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Box sets of the C interface, from C: the pairs against those of two loops, and what goes wrong on purpose. */
#include "check.h"
#include <cullet/cullet.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    kBoxes = 300,
    kSteps = 20
};

/* A box with something else behind it, as programs have them. */
typedef struct Body
{
    float box[6];
    uint32_t id;
    int isIn;
} Body;

static void place(Body* body)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        body->box[axis] = between(0, 12);
        body->box[axis + 3] = body->box[axis] + between(0, 2);
    }
}

static int overlap(const float* a, const float* b)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        if (!(a[axis] <= b[axis + 3] && b[axis] <= a[axis + 3]))
            return 0;
    }
    return 1;
}

static int comparePairs(const void* a, const void* b)
{
    const cullet_pair *p = a, *q = b;
    if (p->first != q->first)
        return p->first < q->first ? -1 : 1;
    return (p->second > q->second) - (p->second < q->second);
}

/* All overlapping pairs, sorted. */
static uint64_t findPairs(const Body* bodies, cullet_pair* pairs)
{
    uint64_t count = 0;
    for (int i = 0; i < kBoxes; ++i)
    {
        for (int j = 0; j < i; ++j)
        {
            const Body *a = &bodies[i], *b = &bodies[j];
            if (!a->isIn || !b->isIn || !overlap(a->box, b->box))
                continue;
            pairs[count].first = a->id < b->id ? a->id : b->id;
            pairs[count++].second = a->id < b->id ? b->id : a->id;
        }
    }
    qsort(pairs, count, sizeof(pairs[0]), comparePairs);
    return count;
}

/* Takes the removed pairs out of a sorted list and puts the added ones in. */
static uint64_t apply(cullet_pair* list, uint64_t count, cullet_pairs added, cullet_pairs removed)
{
    uint64_t kept = 0, gone = 0;
    for (uint64_t i = 0; i < count; ++i)
    {
        if (gone < removed.count && comparePairs(&list[i], &removed.data[gone]) == 0)
            ++gone;
        else
            list[kept++] = list[i];
    }
    CHECK(gone == removed.count);
    for (uint64_t i = 0; i < added.count; ++i)
        list[kept++] = added.data[i];
    qsort(list, kept, sizeof(list[0]), comparePairs);
    return kept;
}

static void changeBodies(cullet_box_set* set, Body* bodies, int step)
{
    for (int i = step % 3; i < kBoxes; i += 3)
    {
        Body* body = &bodies[i];
        place(body);
        if (!body->isIn)
        {
            CHECK(cullet_box_set_add(set, body->box, 0, 1, &body->id) == CULLET_OK);
            body->isIn = 1;
        }
        else if (i % 5 == 0)
        {
            CHECK(cullet_box_set_remove(set, &body->id, 1) == CULLET_OK);
            body->isIn = 0;
        }
        else
        {
            CHECK(cullet_box_set_move(set, &body->id, body->box, 0, 1) == CULLET_OK);
        }
    }
}

static void addBodies(cullet_box_set* set, Body* bodies)
{
    static uint32_t ids[kBoxes];
    for (int i = 0; i < kBoxes; ++i)
    {
        place(&bodies[i]);
        bodies[i].isIn = 1;
    }
    CHECK(cullet_box_set_add(set, bodies[0].box, sizeof(Body), kBoxes, ids) == CULLET_OK);
    for (int i = 0; i < kBoxes; ++i)
    {
        bodies[i].id = ids[i];
        CHECK(ids[i] == (uint32_t)i + 1);
    }
}

static void testPairs(int32_t backend, int32_t threads)
{
    const cullet_box_set_options options = {sizeof(options), backend, threads, 0.0f};
    cullet_box_set* set = NULL;
    CHECK(cullet_box_set_create(&options, &set) == CULLET_OK);

    static Body bodies[kBoxes];
    static cullet_pair expected[kBoxes * kBoxes / 2], followed[kBoxes * kBoxes];
    uint64_t followedCount = 0, removedTotal = 0;
    addBodies(set, bodies);
    for (int step = 0; step < kSteps; ++step)
    {
        cullet_pairs added, removed, all;
        CHECK(cullet_box_set_update(set, &added, &removed) == CULLET_OK);
        CHECK(cullet_box_set_pairs(set, &all) == CULLET_OK);
        const uint64_t count = findPairs(bodies, expected);
        CHECK(count > 50);
        CHECK(all.count == count && memcmp(all.data, expected, count * sizeof(cullet_pair)) == 0);
        followedCount = apply(followed, followedCount, added, removed);
        CHECK(followedCount == count && memcmp(followed, expected, count * sizeof(cullet_pair)) == 0);
        removedTotal += removed.count;
        changeBodies(set, bodies, step);
    }
    CHECK(removedTotal > 100);

    cullet_box_set_stats stats = {sizeof(stats), 0, 0, 0, 0, NULL};
    CHECK(cullet_box_set_get_stats(set, &stats) == CULLET_OK);
    CHECK(stats.boxes > 100 && stats.boxes < kBoxes);
    CHECK(stats.bytes > 1000 && stats.fallbacks == 0);
    CHECK(strcmp(stats.backend, backend == CULLET_BACKEND_BRUTE ? "brute" : "grid") == 0);
    cullet_box_set_destroy(set);
}

static uint64_t pairCount(cullet_box_set* set)
{
    cullet_pairs pairs;
    CHECK(cullet_box_set_update(set, NULL, NULL) == CULLET_OK);
    CHECK(cullet_box_set_pairs(set, &pairs) == CULLET_OK);
    return pairs.count;
}

static void testFiltersAndMargin(void)
{
    const float boxes[12] = {0, 0, 0, 1, 1, 1, 1, 0, 0, 2, 1, 1};
    const cullet_box_set_options options = {sizeof(options), CULLET_BACKEND_AUTO, 1, 0.5f};
    const cullet_filter never = {1, 0}, always = {1, -1};
    cullet_box_set* set = NULL;
    uint32_t ids[2];
    CHECK(cullet_box_set_create(&options, &set) == CULLET_OK);
    CHECK(cullet_box_set_add(set, boxes, 24, 2, ids) == CULLET_OK);
    CHECK(cullet_box_set_filter(set, &ids[0], &never, 1) == CULLET_OK);
    CHECK(pairCount(set) == 0);
    CHECK(cullet_box_set_filter(set, &ids[0], &always, 1) == CULLET_OK);
    CHECK(pairCount(set) == 1);
    /* Apart by less than twice the margin, then by more. */
    const float near[6] = {1.9f, 0, 0, 3, 1, 1}, far[6] = {2.1f, 0, 0, 3, 1, 1};
    CHECK(cullet_box_set_move(set, &ids[1], near, 0, 1) == CULLET_OK);
    CHECK(pairCount(set) == 1);
    CHECK(cullet_box_set_move(set, &ids[1], far, 0, 1) == CULLET_OK);
    CHECK(pairCount(set) == 0);
    cullet_box_set_destroy(set);
}

static void testBadBoxes(void)
{
    const float boxes[18] = {0, 0, 0, 9, 9, 9, 3, 3, 3, 2, 4, 4, 1, NAN, 1, 2, 2, 2};
    const float infinite[6] = {-INFINITY, 1, 1, INFINITY, 2, 2};
    cullet_box_set* set = NULL;
    uint32_t ids[3] = {0, 0, 0};
    CHECK(cullet_box_set_create(NULL, &set) == CULLET_OK);
    CHECK(cullet_box_set_add(set, boxes, 0, 3, ids) == CULLET_EMPTY_BOXES);
    CHECK(ids[2] == 3);
    CHECK(pairCount(set) == 0);
    CHECK(cullet_box_set_move(set, &ids[1], infinite, 0, 1) == CULLET_OK);
    CHECK(pairCount(set) == 1);
    CHECK(cullet_box_set_move(set, &ids[1], &boxes[12], 0, 1) == CULLET_EMPTY_BOXES);
    CHECK(pairCount(set) == 0);
    cullet_box_set_destroy(set);
}

static void testBadOptions(void)
{
    cullet_box_set* set = NULL;
    /* What a program gives that was compiled for a later version. */
    struct
    {
        cullet_box_set_options known;
        uint32_t later;
    } options;
    memset(&options, 0, sizeof(options));

    CHECK(cullet_box_set_create(NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_ERROR_SIZE);
    options.known.size = sizeof(options);
    options.later = 1;
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_ERROR_SIZE && set == NULL);
    options.later = 0;
    options.known.margin = NAN;
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_ERROR_ARGUMENT);
    options.known.margin = INFINITY;
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_ERROR_ARGUMENT);
    options.known.margin = 0;
    options.known.threads = -1;
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_ERROR_ARGUMENT);
    CHECK(strstr(cullet_last_error(), "threads") != NULL);
    options.known.threads = 0;
    options.known.backend = 77;
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_ERROR_ARGUMENT && set == NULL);
    options.known.backend = CULLET_BACKEND_AUTO;
    CHECK(cullet_box_set_create(&options.known, &set) == CULLET_OK);
    cullet_box_set_destroy(set);
    cullet_box_set_destroy(NULL);
}

static void testBadCalls(void)
{
    const float box[6] = {0, 0, 0, 1, 1, 1};
    const cullet_filter filter = {1, -1};
    cullet_box_set* set = NULL;
    uint32_t id = 0;
    CHECK(cullet_box_set_create(NULL, &set) == CULLET_OK);
    CHECK(cullet_box_set_add(NULL, box, 0, 1, &id) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_add(set, NULL, 0, 1, &id) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_add(set, box, 0, 1, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_add(set, box, 23, 1, &id) == CULLET_ERROR_SIZE);
    CHECK(cullet_box_set_add(set, box, 0, (1u << 30) + 1, &id) == CULLET_ERROR_ARGUMENT);
    CHECK(cullet_box_set_add(set, NULL, 0, 0, NULL) == CULLET_OK);
    /* Products of stride and count that do not fit into the addresses, or that wrap to a small one. */
    CHECK(cullet_box_set_add(set, box, SIZE_MAX / 2, 3, &id) == CULLET_ERROR_SIZE);
    CHECK(cullet_box_set_add(set, box, SIZE_MAX - 23, 2, &id) == CULLET_ERROR_SIZE);
    CHECK(id == 0);
    CHECK(cullet_box_set_add(set, box, 0, 1, &id) == CULLET_OK && id == 1);
    CHECK(cullet_box_set_move(set, &id, box, SIZE_MAX - 23, 2) == CULLET_ERROR_SIZE);
    CHECK(cullet_box_set_move(set, &id, box, SIZE_MAX - 23, 1) == CULLET_OK);

    const uint32_t twice[2] = {id, id}, unknown[2] = {id, 99};
    CHECK(cullet_box_set_remove(set, unknown, 2) == CULLET_ERROR_ID);
    CHECK(strstr(cullet_last_error(), "99") != NULL);
    CHECK(cullet_box_set_remove(set, twice, 2) == CULLET_ERROR_ID);
    CHECK(cullet_box_set_move(set, &unknown[1], box, 0, 1) == CULLET_ERROR_ID);
    CHECK(cullet_box_set_move(set, NULL, box, 0, 1) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_move(set, &id, NULL, 0, 1) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_filter(set, &unknown[1], &filter, 1) == CULLET_ERROR_ID);
    CHECK(cullet_box_set_filter(set, &id, NULL, 1) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_update(NULL, NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_pairs(set, NULL) == CULLET_ERROR_NULL);
    cullet_box_set_stats stats = {4, 0, 0, 0, 0, NULL};
    CHECK(cullet_box_set_get_stats(set, &stats) == CULLET_ERROR_SIZE);
    CHECK(cullet_box_set_get_stats(set, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_box_set_remove(set, &id, 1) == CULLET_OK);
    CHECK(cullet_box_set_remove(set, &id, 1) == CULLET_ERROR_ID);
    cullet_box_set_destroy(set);
}

/* With or without a GPU there is an answer. */
static void testDevice(void)
{
    cullet_device_finder* finder = NULL;
    cullet_pairs pairs;
    const cullet_status status = cullet_device_finder_create(NULL, &finder);
    CHECK(status == CULLET_OK || status == CULLET_ERROR_NO_DEVICE);
    if (status == CULLET_OK)
    {
        CHECK(cullet_device_finder_enqueue(finder, NULL, 0) == CULLET_OK);
        CHECK(cullet_device_finder_collect(finder, &pairs) == CULLET_OK && pairs.count == 0);
        CHECK(cullet_device_finder_enqueue(finder, NULL, 1) == CULLET_ERROR_NULL);
        CHECK(cullet_device_finder_collect(finder, NULL) == CULLET_ERROR_NULL);
    }
    else
    {
        printf("%s\n", cullet_last_error());
        CHECK(strstr(cullet_last_error(), "CUDA") != NULL);
        const cullet_box_set_options options = {sizeof(options), CULLET_BACKEND_CUDA, 0, 0.0f};
        cullet_box_set* set = NULL;
        CHECK(cullet_box_set_create(&options, &set) == CULLET_ERROR_NO_DEVICE);
    }
    CHECK(cullet_device_finder_create(NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_device_finder_enqueue(NULL, NULL, 0) == CULLET_ERROR_NULL);
    CHECK(cullet_device_finder_collect(NULL, &pairs) == CULLET_ERROR_NULL);
    cullet_device_finder_destroy(finder);
}

static void testDeviceTriangles(void)
{
    cullet_triangle_trees* trees = NULL;
    cullet_pairs pairs;
    const cullet_status status = cullet_triangle_trees_create(NULL, &trees);
    CHECK(status == CULLET_OK || status == CULLET_ERROR_NO_DEVICE);
    if (status == CULLET_ERROR_NO_DEVICE)
        CHECK(strstr(cullet_last_error(), "CUDA") != NULL && trees == NULL);
    CHECK(cullet_triangle_trees_create(NULL, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_build(NULL, 0, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_refit(NULL, 0, NULL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_enqueue_pairs(NULL, 0, 1) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_enqueue_own_pairs(NULL, 0, CULLET_OWN_PAIRS_ALL) == CULLET_ERROR_NULL);
    CHECK(cullet_triangle_trees_collect(NULL, &pairs, NULL) == CULLET_ERROR_NULL);
    cullet_triangle_trees_destroy(trees);
}

int main(void)
{
    CHECK(cullet_abi_version() >= CULLET_ABI_VERSION);
    CHECK(cullet_precision() == 32 || cullet_precision() == 64);
    CHECK(strlen(cullet_version()) >= 5);
    CHECK(strcmp(cullet_status_name(CULLET_ERROR_ID), "CULLET_ERROR_ID") == 0);
    CHECK(strcmp(cullet_last_error(), "") == 0);
    testPairs(CULLET_BACKEND_AUTO, 1);
    testPairs(CULLET_BACKEND_GRID, 3);
    testPairs(CULLET_BACKEND_BRUTE, 1);
    testFiltersAndMargin();
    testBadBoxes();
    testBadOptions();
    testBadCalls();
    testDevice();
    testDeviceTriangles();
    return finish("boxes");
}
