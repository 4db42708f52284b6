// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/tests/support/number_hash.h"

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

namespace cullet
{
namespace
{
constexpr std::uint32_t kBodies = 20;
constexpr int kPoints = 4;

class Numbers
{
public:
    explicit Numbers(unsigned seed) : m_random(seed) {}

    btScalar next(btScalar low, btScalar high)
    {
        return low + (high - low) * btScalar(m_random() >> 8) / btScalar(1 << 24);
    }
    std::uint32_t body() { return static_cast<std::uint32_t>(m_random() % kBodies); }
    bool isTrue() { return m_random() % 2 == 0; }

    void fill(BlockOf& block, btScalar low, btScalar high)
    {
        for (btScalar& lane : block.lane)
            lane = next(low, high);
    }
    void fill(BlockOfVectors& block, btScalar low, btScalar high)
    {
        fill(block.x, low, high);
        fill(block.y, low, high);
        fill(block.z, low, high);
    }

private:
    std::mt19937 m_random;
};

/// A block of contacts and one of joints with all that kernels read and write. Padding and pointers are the same bytes in
/// copies.
struct Sample
{
    explicit Sample(unsigned seed)
    {
        Numbers numbers(seed);
        std::memset(static_cast<void*>(&contacts), 0, sizeof(contacts));
        std::memset(static_cast<void*>(&joints), 0, sizeof(joints));
        step.inverseTime = 60;
        step.relaxation = 1;
        step.warmStart = btScalar(0.85);
        step.pushBelow = btScalar(-0.04);
        step.bounceAbove = btScalar(0.2);
        step.anchorVelocity = 12;
        step.slidesAlongVelocity = seed % 3 != 0;
        step.notesResidual = true;
        step.isSoft = seed % 4 >= 2;
        step.slidingRows = step.isSoft || seed % 8 == 0 ? 2 : 1;
        step.share = step.isSoft ? btScalar(0.25) : btScalar(1);
        makeBodies(numbers);
        makeContacts(numbers);
        makeJoints(numbers);
    }

    void makeBodies(Numbers& numbers)
    {
        states.resize(kBodies);
        motions.resize(kBodies);
        moved.resize(kBodies);
        for (std::uint32_t i = 0; i < kBodies; ++i)
        {
            btScalar* const state = reinterpret_cast<btScalar*>(&states[i]);
            for (int k = 0; k < 28; ++k)
                state[k] = i == kFixedBody ? 0 : numbers.next(-1, 1);
            states[i].inertiaXX = states[i].inertiaYY = states[i].inertiaZZ = i == kFixedBody ? 0 : 3;
            states[i].inverseMass = states[i].inverseMassX = states[i].inverseMassY = states[i].inverseMassZ =
                i == kFixedBody ? 0 : 1;
            states[i].factorX = states[i].factorY = states[i].factorZ = 1;
            moved[i] = {};
            for (int k = 0; k < 3 && i != kFixedBody; ++k)
                moved[i].linear[k] = numbers.next(btScalar(-0.01), btScalar(0.01));
        }
    }

    static void makeBlock(Numbers& numbers, BlockBodies& bodies)
    {
        bodies.clear();
        // No body twice, as in a colour.
        const std::uint32_t first = numbers.body() % 3;
        for (std::uint32_t lane = 0; lane < kBlock; ++lane)
        {
            const bool isOnFloor = numbers.isTrue();
            const std::uint32_t a = first + 2 * lane + 1, b = isOnFloor ? kFixedBody : first + 2 * lane + 2;
            bodies.set(lane, {a, true}, {b, b != kFixedBody});
        }
    }

    void makeContacts(Numbers& numbers)
    {
        makeBlock(numbers, contacts.bodies);
        contacts.lanes = kBlock;
        contacts.points = kPoints;
        std::uint32_t rows = 0;
        for (int k = 0; k < kPoints; ++k)
        {
            contacts.rows[k] = {rows, static_cast<std::uint32_t>(k), k % 2 == 0, true};
            rows += 1u + static_cast<std::uint32_t>(step.slidingRows) + (k % 2 == 0 ? 3u : 0u);
            makePoint(numbers, k, sources[k]);
        }
        contactRows.resize(rows);
        pushes.resize(kPoints);
    }

    void makePoint(Numbers& numbers, int k, PointSource& source)
    {
        std::memset(static_cast<void*>(&source), 0, sizeof(source));
        numbers.fill(source.positionA, -1, 1);
        numbers.fill(source.positionB, -1, 1);
        numbers.fill(source.normal, -1, 1);
        numbers.fill(source.gap, btScalar(-0.1), btScalar(0.05));
        numbers.fill(source.friction, 0, 1);
        numbers.fill(source.restitution, 0, 1);
        numbers.fill(source.impulse, 0, 1);
        numbers.fill(source.errorReduction, 0, 1);
        numbers.fill(source.softness, 0, 1);
        numbers.fill(source.slideImpulse, -1, 1);
        source.turns = k % 2 == 0;
        numbers.fill(source.spinning, 0, 1);
        numbers.fill(source.rolling, 0, 1);
        numbers.fill(source.roll[0], -1, 1);
        numbers.fill(source.roll[1], -1, 1);
        for (int lane = 0; lane < kBlock; ++lane)
            makeLane(numbers, lane, source);
    }

    /// Normals of a unit's length; one of them steep, one straight; some lanes without a point.
    static void makeLane(Numbers& numbers, int lane, PointSource& source)
    {
        btVector3 normal(source.normal.x.lane[lane], source.normal.y.lane[lane], source.normal.z.lane[lane]);
        normal.normalize();
        if (lane == 0)
            normal.setValue(0, 0, 1);
        if (lane == 1)
            normal.setValue(0, 1, 0);
        source.isLive.lane[lane] = numbers.next(0, 1) < btScalar(0.8) ? 1 : 0;
        if (source.isLive.lane[lane] == 0)
            normal.setZero();
        source.normal.x.lane[lane] = normal.x();
        source.normal.y.lane[lane] = normal.y();
        source.normal.z.lane[lane] = normal.z();
    }

    void makeJoints(Numbers& numbers)
    {
        makeBlock(numbers, joints.bodies);
        joints.lanes = kBlock;
        joints.rows = 6;
        joints.first = 0;
        joints.iterations = 10;
        numbers.fill(joints.damping, btScalar(0.5), 1);
        jointRows.resize(6);
        for (JointRowBlock& row : jointRows)
        {
            std::memset(static_cast<void*>(&row), 0, sizeof(row));
            for (BlockOfVectors* vectors : {&row.linearA, &row.armA, &row.linearB, &row.armB})
                numbers.fill(*vectors, -1, 1);
            numbers.fill(row.target, -1, 1);
            numbers.fill(row.softness, 0, btScalar(0.1));
            numbers.fill(row.least, -1, 0);
            numbers.fill(row.most, 0, 1);
            numbers.fill(row.isLasting, -1, 1);
        }
    }

    /// Everything that a step does with kernels, a few times.
    void solve(const RowKernels& kernels)
    {
        kernels.setUp(step, states.data(), contacts, sources, contactRows.data(), pushes.data(),
                      motions.data());
        kernels.setUpJoints(step, states.data(), joints, jointRows.data());
        for (int i = 0; i < 4; ++i)
        {
            residuals.push_back(kernels.solveJoints(step, joints, i == 3 ? &sources[0].isLive : nullptr,
                                                    i % 2 == 1, jointRows.data(), motions.data()));
            if (step.isSoft)
                solveSoft(kernels, i % 2 == 0);
            else
                solveHard(kernels);
        }
        if (!step.isSoft)
            residuals.push_back(kernels.push(contacts, contactRows.data(), pushes.data(), moved.data()));
        else
            kernels.bounce(contacts, contactRows.data(), pushes.data(), motions.data());
    }

    btScalar solveHard(const RowKernels& kernels)
    {
        const btScalar pressing = kernels.press(step, &contacts, 1, contactRows.data(), motions.data());
        const btScalar rubbing = kernels.rub(step, &contacts, 1, contactRows.data(), motions.data());
        residuals.push_back(pressing);
        residuals.push_back(rubbing);
        return std::max(pressing, rubbing);
    }

    void solveSoft(const RowKernels& kernels, bool isPushing)
    {
        const SoftStep substep = {240,
                                  3,
                                  {btScalar(9), btScalar(0.9), btScalar(0.05)},
                                  {18, btScalar(0.95), btScalar(0.02)},
                                  isPushing};
        kernels.applyContacts(step, contacts, contactRows.data(), motions.data());
        kernels.applyJoints(joints, jointRows.data(), motions.data());
        kernels.solveSoft(step, substep, &contacts, 1, contactRows.data(), pushes.data(), moved.data(),
                          motions.data());
    }

    SolverStep step{};
    std::vector<SolverBodyState> states;
    std::vector<SolverMotion> motions, moved;
    ContactBlock contacts;
    PointSource sources[kPoints];
    std::vector<RowBlock> contactRows;
    std::vector<PushBlock> pushes;
    JointBlock joints;
    std::vector<JointRowBlock> jointRows;
    std::vector<btScalar> residuals;
};

template <class T>
bool haveSameBytes(const std::vector<T>& a, const std::vector<T>& b)
{
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

void expectSameResults(const Sample& a, const Sample& b)
{
    EXPECT_TRUE(haveSameBytes(a.contactRows, b.contactRows));
    EXPECT_TRUE(haveSameBytes(a.jointRows, b.jointRows));
    EXPECT_TRUE(haveSameBytes(a.pushes, b.pushes));
    EXPECT_TRUE(haveSameBytes(a.motions, b.motions));
    EXPECT_TRUE(haveSameBytes(a.moved, b.moved));
    EXPECT_TRUE(haveSameBytes(a.residuals, b.residuals));
}

/// Those that this processor can run, apart from the baseline.
std::vector<const RowKernels*> widerKernels()
{
    std::vector<const RowKernels*> kernels;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") != 0)
        kernels.push_back(&rowKernelsAvx2());
    if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0)
        kernels.push_back(&rowKernelsAvx512());
#endif
    return kernels;
}

TEST(RowKernels, GiveSameBitsWithEachInstructionSet)
{
    const std::vector<const RowKernels*> wider = widerKernels();
    if (wider.empty())
        GTEST_SKIP() << "the processor has the baseline's instructions only";
    for (unsigned seed = 1; seed <= 200; ++seed)
    {
        SCOPED_TRACE(seed);
        Sample baseline(seed);
        baseline.solve(rowKernelsBaseline());
        for (const RowKernels* kernels : wider)
        {
            Sample same(seed);
            same.solve(*kernels);
            expectSameResults(baseline, same);
        }
    }
}

template <class T>
void addNumbers(test::NumberHash& hash, const std::vector<T>& structures)
{
    static_assert(sizeof(T) % sizeof(btScalar) == 0);
    btScalar number;
    const char* const bytes = reinterpret_cast<const char*>(structures.data());
    for (std::size_t at = 0; at < structures.size() * sizeof(T); at += sizeof(number))
    {
        std::memcpy(&number, bytes + at, sizeof(number));
        hash.add(number);
    }
}

/// Processors whose kernels have no others beside them are compared with this one.
TEST(RowKernels, GiveRecordedBitsOnEveryMachine)
{
    test::NumberHash hash;
    for (unsigned seed = 1; seed <= 200; ++seed)
    {
        Sample sample(seed);
        sample.solve(rowKernels());
        addNumbers(hash, sample.contactRows);
        addNumbers(hash, sample.jointRows);
        addNumbers(hash, sample.pushes);
        addNumbers(hash, sample.motions);
        addNumbers(hash, sample.moved);
        addNumbers(hash, sample.residuals);
    }
    const std::uint64_t recorded = sizeof(btScalar) == 4 ? 0x3beabcbec3800745u : 0x221dd3643c4ba76eu;
    EXPECT_EQ(hash.value(), recorded) << std::hex << "0x" << hash.value() << "u";
}

TEST(RowKernels, ChangeVelocitiesWithoutNaN)
{
    int changed = 0;
    for (unsigned seed = 1; seed <= 200; ++seed)
    {
        SCOPED_TRACE(seed);
        Sample sample(seed);
        sample.solve(rowKernels());
        for (const SolverMotion& motion : sample.motions)
        {
            for (const btScalar number : motion.linear)
                ASSERT_TRUE(std::isfinite(number));
            for (const btScalar number : motion.angular)
                ASSERT_TRUE(std::isfinite(number));
            changed += motion.linear[0] != 0 ? 1 : 0;
        }
        EXPECT_EQ(sample.motions[kFixedBody].linear[0], 0);
    }
    EXPECT_GT(changed, 1000);
}

/// Contacts beyond the colours are in blocks of one lane, which may move the same body.
TEST(RowKernels, SolveBlocksOfOneLaneOneAfterTheOther)
{
    std::vector<const RowKernels*> all = widerKernels();
    all.push_back(&rowKernelsBaseline());
    for (const RowKernels* kernels : all)
    {
        Sample sample(8), other(16);
        ContactBlock blocks[] = {sample.contacts, other.contacts};
        for (std::uint32_t i = 0; i < 2; ++i)
        {
            blocks[i].lanes = 1;
            blocks[i].bodies.clear();
            blocks[i].bodies.set(0, {1, true}, {i + 2, true});
            Sample& own = i == 0 ? sample : other;
            for (PointSource& source : own.sources)
                source.isLive.lane[0] = 1;
            kernels->setUp(sample.step, sample.states.data(), blocks[i], own.sources, own.contactRows.data(),
                           own.pushes.data(), sample.motions.data());
        }
        // The rows of both in one array.
        std::vector<RowBlock> together = sample.contactRows;
        together.insert(together.end(), other.contactRows.begin(), other.contactRows.end());
        for (PointRows& rows : blocks[1].rows)
            rows.first += static_cast<std::uint32_t>(sample.contactRows.size());
        std::vector<RowBlock> apart = together;
        std::vector<SolverMotion> before = sample.motions, motions = sample.motions;
        kernels->press(sample.step, blocks, 2, together.data(), sample.motions.data());
        kernels->press(sample.step, &blocks[0], 1, apart.data(), motions.data());
        EXPECT_FALSE(haveSameBytes(before, motions));
        before = motions;
        kernels->press(sample.step, &blocks[1], 1, apart.data(), motions.data());
        EXPECT_FALSE(haveSameBytes(before, motions));
        EXPECT_TRUE(haveSameBytes(sample.motions, motions));
        EXPECT_TRUE(haveSameBytes(together, apart));
    }
}

TEST(RowKernels, LeaveNormalsWithoutApproachAndPull)
{
    Sample sample(4);
    sample.step.isSoft = false;
    sample.step.share = 1;
    const RowKernels& kernels = rowKernels();
    kernels.setUp(sample.step, sample.states.data(), sample.contacts, sample.sources,
                  sample.contactRows.data(), sample.pushes.data(), sample.motions.data());
    btScalar last = 0;
    for (int i = 0; i < 2000; ++i)
        last = sample.solveHard(kernels);
    EXPECT_LT(last, btScalar(1e-4));
    for (int k = 0; k < kPoints; ++k)
    {
        const RowBlock& row = sample.contactRows[sample.contacts.rows[k].first];
        for (int lane = 0; lane < kBlock; ++lane)
            EXPECT_GE(row.impulse.lane[lane], 0);
    }
}
}  // namespace
}  // namespace cullet
