/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Batches of hull queries, from C: against queries of one pair each, and what goes wrong on purpose. */
#include "check.h"
#include <cullet/cullet.h>
#include <math.h>
#include <string.h>

enum
{
    kBodies = 40,
    kPairs = 600
};

static cullet_hull* hulls[3];
static const cullet_hull* hullsOfA[kBodies];
static const cullet_hull* hullsOfB[kBodies];
static cullet_pose posesOfA[kBodies];
static cullet_pose posesOfB[kBodies];
static cullet_pair pairs[kPairs];

static cullet_hull* makeHull(uint32_t count)
{
    double points[40][3];
    cullet_hull* hull = NULL;
    for (uint32_t i = 0; i < count; ++i)
    {
        for (int axis = 0; axis < 3; ++axis)
            points[i][axis] = between(-1, 1);
    }
    CHECK(cullet_hull_create(points[0], 0, count, &hull) == CULLET_OK);
    return hull;
}

/* A rotation about z and one about x, somewhere. */
static cullet_pose anyPose(void)
{
    const double first = between(0, 6), second = between(0, 6);
    const double c = cos(first), s = sin(first), d = cos(second), t = sin(second);
    const cullet_pose pose = {{c, -s * d, s * t, s, c * d, -c * t, 0, t, d},
                              {between(-1.5f, 1.5f), between(-1.5f, 1.5f), between(-1.5f, 1.5f)}};
    return pose;
}

static void makeScene(void)
{
    for (int i = 0; i < 3; ++i)
        hulls[i] = makeHull(i == 0 ? 8 : 40);
    for (int i = 0; i < kBodies; ++i)
    {
        hullsOfA[i] = hulls[i % 3];
        hullsOfB[i] = hulls[i % 2];
        posesOfA[i] = anyPose();
        posesOfB[i] = anyPose();
    }
    for (int i = 0; i < kPairs; ++i)
    {
        pairs[i].first = (uint32_t)between(0, kBodies - 0.5f);
        pairs[i].second = (uint32_t)between(0, kBodies - 0.5f);
    }
}

static cullet_hull_batch makeBatch(int32_t query)
{
    cullet_hull_batch batch;
    memset(&batch, 0, sizeof(batch));
    batch.size = sizeof(batch);
    batch.query = query;
    batch.a.hulls = hullsOfA;
    batch.a.poses = posesOfA;
    batch.a.count = kBodies;
    batch.b.hulls = hullsOfB;
    batch.b.poses = posesOfB;
    batch.b.count = kBodies;
    batch.pairs = pairs;
    batch.pair_count = kPairs;
    batch.max_distance = 0.5;
    batch.threads = 1;
    return batch;
}

typedef struct Answers
{
    int32_t states[kPairs];
    double distances[kPairs];
    double axes[kPairs][3];
    double pointsOfA[kPairs][3];
    double pointsOfB[kPairs][3];
} Answers;

static cullet_hull_results arraysOf(Answers* answers)
{
    cullet_hull_results results;
    memset(answers, 0x55, sizeof(*answers));
    memset(&results, 0, sizeof(results));
    results.size = sizeof(results);
    results.states = answers->states;
    results.distances = answers->distances;
    results.axes = answers->axes[0];
    results.points_a = answers->pointsOfA[0];
    results.points_b = answers->pointsOfB[0];
    return results;
}

static cullet_hull_result queryAlone(int32_t query, int i)
{
    const uint32_t a = pairs[i].first, b = pairs[i].second;
    cullet_hull_result result;
    memset(&result, 0, sizeof(result));
    result.size = sizeof(result);
    int32_t overlaps = 0;
    if (query == CULLET_QUERY_OVERLAP)
    {
        CHECK(cullet_hull_overlap(hullsOfA[a], &posesOfA[a], hullsOfB[b], &posesOfB[b], NULL, &overlaps,
                                  result.axis) == CULLET_OK);
        result.state = overlaps ? CULLET_OVERLAPPING : CULLET_SEPARATED;
        return result;
    }
    if (query != CULLET_QUERY_PENETRATION)
        CHECK(cullet_hull_distance(hullsOfA[a], &posesOfA[a], hullsOfB[b], &posesOfB[b], 0.5, NULL,
                                   &result) == CULLET_OK);
    if (query == CULLET_QUERY_PENETRATION ||
        (query == CULLET_QUERY_CONTACT && result.state == CULLET_OVERLAPPING))
        CHECK(cullet_hull_penetration(hullsOfA[a], &posesOfA[a], hullsOfB[b], &posesOfB[b], NULL, &result) ==
              CULLET_OK);
    return result;
}

/* A depth that was searched from the end of another query differs in its last digits. */
static int areNear(const double* a, const double* b, int count)
{
    for (int i = 0; i < count; ++i)
    {
        if (!(fabs(a[i] - b[i]) < 1e-9))
            return 0;
    }
    return 1;
}

static void testAgainstSingleQueries(int32_t query)
{
    static Answers answers;
    int countOf[3] = {0, 0, 0};
    const cullet_hull_batch batch = makeBatch(query);
    const cullet_hull_results results = arraysOf(&answers);
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
    for (int i = 0; i < kPairs; ++i)
    {
        const cullet_hull_result alone = queryAlone(query, i);
        ++countOf[alone.state];
        CHECK(answers.states[i] == alone.state);
        CHECK(areNear(&answers.distances[i], &alone.distance, 1));
        CHECK(areNear(answers.axes[i], alone.axis, 3));
        CHECK(areNear(answers.pointsOfA[i], alone.point_a, 3));
        CHECK(areNear(answers.pointsOfB[i], alone.point_b, 3));
    }
    const int hasDistances = query == CULLET_QUERY_DISTANCE || query == CULLET_QUERY_CONTACT;
    CHECK(countOf[CULLET_OVERLAPPING] > kPairs / 10 && countOf[CULLET_SEPARATED] > kPairs / 10);
    CHECK(countOf[CULLET_NEAR] > (hasDistances ? kPairs / 10 : -1));
}

/* Other threads, another order and other pairs beside it change no bit of a pair. */
static void testThreadsAndOrder(int32_t query)
{
    static Answers one, many, reversed;
    static cullet_pair backward[kPairs];
    for (int i = 0; i < kPairs; ++i)
        backward[i] = pairs[kPairs - 1 - i];
    cullet_hull_batch batch = makeBatch(query);
    cullet_hull_results results = arraysOf(&one);
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
    batch.threads = 4;
    results = arraysOf(&many);
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
    CHECK(memcmp(&one, &many, sizeof(one)) == 0);
    batch.pairs = backward;
    results = arraysOf(&reversed);
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
    for (int i = 0; i < kPairs; ++i)
    {
        const int j = kPairs - 1 - i;
        CHECK(one.states[i] == reversed.states[j]);
        CHECK(memcmp(&one.distances[i], &reversed.distances[j], sizeof(double)) == 0);
        CHECK(memcmp(one.axes[i], reversed.axes[j], sizeof(one.axes[i])) == 0);
        CHECK(memcmp(one.pointsOfA[i], reversed.pointsOfA[j], sizeof(one.pointsOfA[i])) == 0);
    }
}

/* Without pairs: body by body, and one for all. */
static void testBodiesWithoutPairs(void)
{
    static Answers listed, implied;
    cullet_pair inOrder[kBodies];
    for (int single = 0; single < 3; ++single)
    {
        for (uint32_t i = 0; i < kBodies; ++i)
        {
            inOrder[i].first = single == 1 ? 0 : i;
            inOrder[i].second = single == 2 ? 0 : i;
        }
        cullet_hull_batch batch = makeBatch(CULLET_QUERY_CONTACT);
        batch.pairs = inOrder;
        batch.pair_count = kBodies;
        cullet_hull_results results = arraysOf(&listed);
        CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
        batch.pairs = NULL;
        batch.a.count = single == 1 ? 1 : kBodies;
        batch.b.count = single == 2 ? 1 : kBodies;
        results = arraysOf(&implied);
        CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
        CHECK(memcmp(&listed, &implied, sizeof(listed)) == 0);
    }
}

/* Cubes in a row without poses, an unwanted array, and no pairs at all. */
static void testDefaults(void)
{
    static Answers answers, untouched;
    cullet_hull_batch batch = makeBatch(CULLET_QUERY_OVERLAP);
    cullet_hull_results results = arraysOf(&answers);
    batch.a.poses = batch.b.poses = NULL;
    results.axes = results.points_a = results.points_b = NULL;
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
    for (int i = 0; i < kPairs; ++i)
        CHECK(answers.states[i] == CULLET_OVERLAPPING && answers.distances[i] == 0);
    CHECK(arraysOf(&untouched).size == sizeof(results));
    CHECK(memcmp(answers.axes, untouched.axes, sizeof(answers.axes)) == 0);

    memset(&batch, 0, sizeof(batch));
    batch.size = sizeof(batch);
    results = arraysOf(&answers);
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_OK);
    CHECK(memcmp(&answers, &untouched, sizeof(answers)) == 0);
}

/* Beyond double precision, the other pairs have their answers. */
static void testPairWithoutAnswer(void)
{
    static Answers answers;
    cullet_hull_batch batch = makeBatch(CULLET_QUERY_CONTACT);
    const cullet_hull_results results = arraysOf(&answers);
    const cullet_pose before = posesOfA[3];
    for (int i = 0; i < 9; ++i)
        posesOfA[3].basis[i] *= 1e100;
    for (int i = 0; i < 3; ++i)
        posesOfA[3].origin[i] = 1e300;
    CHECK(cullet_hull_query_batch(&batch, &results) == CULLET_SOME_NOT_CONVERGED);
    int withoutAnswer = 0;
    for (int i = 0; i < kPairs; ++i)
    {
        const int hasNone = answers.states[i] == CULLET_NOT_CONVERGED;
        withoutAnswer += hasNone;
        CHECK(!hasNone || (pairs[i].first == 3 && answers.distances[i] == 0 && answers.axes[i][0] == 0));
    }
    CHECK(withoutAnswer > 0);
    posesOfA[3] = before;
}

/* What a failing call returns; it writes nothing. */
static void expectError(cullet_status status, const cullet_hull_batch* batch)
{
    static Answers answers, untouched;
    const cullet_hull_results results = arraysOf(&answers);
    arraysOf(&untouched);
    CHECK(cullet_hull_query_batch(batch, &results) == status);
    CHECK(memcmp(&answers, &untouched, sizeof(answers)) == 0);
}

static void testErrorsOfNumbers(void)
{
    cullet_hull_batch batch = makeBatch(4);
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(-1);
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.max_distance = NAN;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.threads = -1;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.pair_count = (uint64_t)1 << 32;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.pairs = NULL;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.reserved = 1;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.b.reserved = 1;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    batch = makeBatch(0);
    batch.size = 16;
    expectError(CULLET_ERROR_SIZE, &batch);
}

static void testErrorsOfBodies(void)
{
    static Answers answers;
    const cullet_hull_results results = arraysOf(&answers);
    cullet_hull_batch batch = makeBatch(0);
    CHECK(cullet_hull_query_batch(NULL, &results) == CULLET_ERROR_NULL);
    CHECK(cullet_hull_query_batch(&batch, NULL) == CULLET_ERROR_NULL);
    batch.a.hulls = NULL;
    expectError(CULLET_ERROR_NULL, &batch);
    batch = makeBatch(0);
    hullsOfB[7] = NULL;
    expectError(CULLET_ERROR_NULL, &batch);
    hullsOfB[7] = hulls[0];
    batch = makeBatch(0);
    const cullet_pair pair = pairs[9];
    pairs[9].first = kBodies;
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    pairs[9] = pair;
    pairs[9].second = kBodies;
    batch = makeBatch(0);
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    pairs[9] = pair;
    cullet_pose before = posesOfB[11];
    posesOfB[11].origin[2] = INFINITY;
    expectError(CULLET_ERROR_NOT_FINITE, &batch);
    posesOfB[11] = before;
    memset(posesOfB[11].basis, 0, sizeof(before.basis));
    expectError(CULLET_ERROR_ARGUMENT, &batch);
    posesOfB[11] = before;
}

int main(void)
{
    makeScene();
    for (int32_t query = CULLET_QUERY_OVERLAP; query <= CULLET_QUERY_CONTACT; ++query)
    {
        testAgainstSingleQueries(query);
        testThreadsAndOrder(query);
    }
    testBodiesWithoutPairs();
    testDefaults();
    testPairWithoutAnswer();
    testErrorsOfNumbers();
    testErrorsOfBodies();
    for (int i = 0; i < 3; ++i)
        cullet_hull_destroy(hulls[i]);
    return finish("batches");
}
