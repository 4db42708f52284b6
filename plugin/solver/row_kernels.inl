// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// RowKernels for the register that CULLET_SOLVER_REGISTER names, with internal linkage.
#include "cullet/plugin/solver/row_set_up.inl"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// How often an iteration solves a block's rows, which lie in the nearest cache then: the points of a manifold depend on
/// each other most. Two sweeps cost an eighth more than one, and leave a pile a third less of its motion.
constexpr int kSweeps = 2;

/// Changes a row's impulse so that its target is reached, within bounds, and applies the change.
///
/// @return the change
[[gnu::always_inline]] inline Wide solveRow(RowBlock& row, int part, Wide least, Wide most,
                                            const PairMass& mass, PairMotion& pair)
{
    const Wide before = load(row.impulse, part);
    const Wide wanted = wantedImpulse(row, part, load(row.target, part), before, pair);
    const Wide after = lesser(larger(wanted, least), most);
    store(row.impulse, part, after);
    const Wide change = after - before;
    apply(row, part, change, mass, pair);
    return change;
}

/// The largest square of a change of velocity in the lanes.
[[gnu::always_inline]] inline void noteResidual(Wide change, Wide inverse, Wide& residual)
{
    const Wide velocity = inverse > Wide{} ? change / inverse : Wide{};
    residual = larger(velocity * velocity, residual);
}

inline btScalar largestLane(Wide wide)
{
    btScalar largest = wide[0];
    for (int i = 1; i < kLanes; ++i)
        largest = wide[i] > largest ? wide[i] : largest;
    return largest;
}

/// The rows of turning friction of a point.
///
/// @param share by which the coefficients bound them: the normal's impulse, of at most one as with Bullet
template <class Note>
[[gnu::always_inline]] inline void solveTurning(RowBlock* rows, int part, Wide share, const PairMass& mass,
                                                PairMotion& pair, const Note& note)
{
    for (int i = 0; i < 3; ++i)
    {
        const Wide most = load(rows[i].bound, part) * share;
        note(solveRow(rows[i], part, -most, most, mass, pair), rows[i]);
    }
}

/// The rows of friction of a point.
///
/// @param note called with the change and the row
template <class Note>
[[gnu::always_inline]] inline void solveFriction(const SolverStep& step, const PointRows& point,
                                                 RowBlock* rows, int part, const PairMass& mass,
                                                 PairMotion& pair, const Note& note)
{
    const Wide pressed = load(rows[point.first].impulse, part);
    RowBlock* row = rows + point.first + 1;
    for (const RowBlock* const end = row + step.slidingRows; row < end; ++row)
    {
        const Wide most = load(row->bound, part) * pressed;
        note(solveRow(*row, part, -most, most, mass, pair), *row);
    }
    if (point.turns)
        solveTurning(row, part, lesser(pressed, fill(1)), mass, pair, note);
}

template <class Second>
[[gnu::always_inline]] inline int mostPoints(const BlockPart& first, Second second)
{
    if constexpr (kIsPart<Second>)
        return second->block.points > first.block.points ? second->block.points : first.block.points;
    return first.block.points;
}

/// Calls solvePoint(point, part, mass, pair, note) for the points of blocks, in sweeps.
///
/// @param note  to be called with the change of each row and the row
template <bool kNotesResidual, class SolvePoint>
[[gnu::always_inline]] inline btScalar sweepBlocks(const ContactBlock* blocks, std::size_t count,
                                                   SolverMotion* motions, const SolvePoint& solvePoint)
{
    Wide residual{};
    const auto solve = [&](BlockPart& of, int k)
    {
        if (k >= of.block.points)
            return;
        const auto note = [&](Wide change, const RowBlock& row)
        {
            if constexpr (kNotesResidual)
                noteResidual(change, load(row.inverse, of.part), residual);
        };
        solvePoint(of.block.rows[k], of.part, of.mass, of.pair, note);
    };
    const auto sweep = [&](BlockPart& first, auto second)
    {
        const int points = mostPoints(first, second);
        for (int i = 0; i < kSweeps; ++i)
        {
            for (int k = 0; k < points; ++k)
            {
                solve(first, k);
                if constexpr (kIsPart<decltype(second)>)
                    solve(*second, k);
            }
        }
    };
    forEachTwo(blocks, count, motions, sweep);
    return kNotesResidual ? largestLane(residual) : 0;
}

template <bool kNotesResidual>
btScalar pressBlocks(const ContactBlock* blocks, std::size_t count, RowBlock* rows, SolverMotion* motions)
{
    const auto press =
        [rows](const PointRows& point, int part, const PairMass& mass, PairMotion& pair, const auto& note)
    {
        RowBlock& normal = rows[point.first];
        note(solveRow(normal, part, Wide{}, fill(btScalar(BT_LARGE_FLOAT)), mass, pair), normal);
    };
    return sweepBlocks<kNotesResidual>(blocks, count, motions, press);
}

template <bool kNotesResidual>
btScalar rubBlocks(const SolverStep& step, const ContactBlock* blocks, std::size_t count, RowBlock* rows,
                   SolverMotion* motions)
{
    const auto rub = [&step, rows](const PointRows& point, int part, const PairMass& mass, PairMotion& pair,
                                   const auto& note)
    { solveFriction(step, point, rows, part, mass, pair, note); };
    return sweepBlocks<kNotesResidual>(blocks, count, motions, rub);
}

btScalar press(const SolverStep& step, const ContactBlock* blocks, std::size_t count, RowBlock* rows,
               SolverMotion* motions)
{
    return step.notesResidual ? pressBlocks<true>(blocks, count, rows, motions)
                              : pressBlocks<false>(blocks, count, rows, motions);
}

btScalar rub(const SolverStep& step, const ContactBlock* blocks, std::size_t count, RowBlock* rows,
             SolverMotion* motions)
{
    return step.notesResidual ? rubBlocks<true>(step, blocks, count, rows, motions)
                              : rubBlocks<false>(step, blocks, count, rows, motions);
}

/// As solveRow() for the velocity that only moves bodies apart.
[[gnu::always_inline]] inline Wide pushRow(const RowBlock& row, int part, PushBlock& push,
                                           const PairMass& mass, PairMotion& pair)
{
    const Wide zero{}, before = load(push.impulse, part), target = load(push.target, part);
    const Wide wanted = wantedImpulse(row, part, target, before, pair);
    const Wide after = target != zero ? larger(wanted, zero) : zero;
    store(push.impulse, part, after);
    apply(row, part, after - before, mass, pair);
    return after - before;
}

btScalar push(const ContactBlock& block, const RowBlock* rows, PushBlock* pushes, SolverMotion* motions)
{
    Wide residual{};
    const auto pushPart = [&](int part, const PairMass& mass, PairMotion& pair)
    {
        for (int k = 0; k < block.points; ++k)
        {
            const PointRows& point = block.rows[k];
            if (point.push == PointRows::kNoPush)
                continue;
            const RowBlock& row = rows[point.first];
            noteResidual(pushRow(row, part, pushes[point.push], mass, pair), load(row.inverse, part),
                         residual);
        }
    };
    forEachPart(block.bodies, motions, pushPart);
    return largestLane(residual);
}

[[gnu::always_inline]] inline void applyJoint(const JointRowBlock& row, int part, Wide impulse,
                                              const PairMass& mass, PairMotion& pair)
{
    pair.linearA = pair.linearA + scale(load(row.linearA, part) * impulse, mass.a);
    pair.linearB = pair.linearB + scale(load(row.linearB, part) * impulse, mass.b);
    pair.angularA = pair.angularA + load(row.turnA, part) * impulse;
    pair.angularB = pair.angularB + load(row.turnB, part) * impulse;
}

[[gnu::always_inline]] inline Wide solveJointRow(JointRowBlock& row, const BlockOf& target, int part,
                                                 WideMask isActive, const PairMass& mass, PairMotion& pair)
{
    const Wide3 linearA = load(row.linearA, part), linearB = load(row.linearB, part);
    const Wide velocity = dot(linearA, pair.linearA) + dot(load(row.armA, part), pair.angularA) +
                          dot(linearB, pair.linearB) + dot(load(row.armB, part), pair.angularB);
    const Wide before = load(row.impulse, part);
    const Wide wanted = before + (load(target, part) - before * load(row.softness, part) -
                                  velocity * load(row.inverse, part));
    const Wide bounded = lesser(larger(wanted, load(row.least, part)), load(row.most, part));
    const Wide after = isActive ? bounded : before;
    const Wide change = after - before;
    store(row.impulse, part, after);
    applyJoint(row, part, change, mass, pair);
    return change;
}

btScalar solveJoints(const SolverStep& step, const JointBlock& block, const BlockOf* isActive, bool relaxes,
                     JointRowBlock* rows, SolverMotion* motions)
{
    Wide residual{};
    const auto solvePart = [&](int part, const PairMass& mass, PairMotion& pair)
    {
        const WideMask active = isActive != nullptr ? load(*isActive, part) > Wide{} : inAllLanes(true);
        for (int i = 0; i < block.rows; ++i)
        {
            JointRowBlock& row = rows[block.first + unsigned(i)];
            const Wide change =
                solveJointRow(row, relaxes ? row.relaxed : row.target, part, active, mass, pair);
            if (step.notesResidual)
                noteResidual(change, load(row.inverse, part), residual);
        }
    };
    forEachPart(block.bodies, motions, solvePart);
    return largestLane(residual);
}

void applyContacts(const SolverStep& step, const ContactBlock& block, const RowBlock* rows,
                   SolverMotion* motions)
{
    applyRows(block, rows, motions,
              [&](const PointRows& point) { return 1 + step.slidingRows + (point.turns ? 3 : 0); });
}

void applyJoints(const JointBlock& block, const JointRowBlock* rows, SolverMotion* motions)
{
    const auto applyPart = [&](int part, const PairMass& mass, PairMotion& pair)
    {
        for (int i = 0; i < block.rows; ++i)
        {
            const JointRowBlock& row = rows[block.first + unsigned(i)];
            const Wide impulse = load(row.isLasting, part) > Wide{} ? Wide{} : load(row.impulse, part);
            applyJoint(row, part, impulse, mass, pair);
        }
    };
    forEachPart(block.bodies, motions, applyPart);
}

/// A part of a block's contacts as springs: those of the lanes with a body that does not move are stiffer.
struct WideSoftness
{
    Wide approach, mass, yield;
};

[[gnu::always_inline]] inline WideSoftness softnessOf(const SoftStep& substep, const PairMass& mass)
{
    const Wide zero{};
    const WideMask isFixed =
        (mass.a.x + mass.a.y + mass.a.z == zero) | (mass.b.x + mass.b.y + mass.b.z == zero);
    const SoftContact &moving = substep.moving, &fixed = substep.fixed;
    return {isFixed ? fill(fixed.approach) : fill(moving.approach),
            isFixed ? fill(fixed.mass) : fill(moving.mass), isFixed ? fill(fixed.yield) : fill(moving.yield)};
}

/// @param moved how far the bodies have moved in the step
[[gnu::always_inline]] inline void solveSoftNormal(const SoftStep& substep, const WideSoftness& soft,
                                                   int part, const PairMotion& moved, const PairMass& mass,
                                                   RowBlock& row, PairMotion& pair)
{
    const Wide zero{}, before = load(row.impulse, part);
    const Wide gap = load(row.target, part) + along(row, part, moved);
    const WideMask isApart = gap > zero;
    const WideMask isSoft = ~isApart & inAllLanes(substep.pushes);
    const Wide apart = gap * fill(substep.inverseTime);
    const Wide pushed = isSoft ? larger(gap * soft.approach, fill(-substep.mostPush)) : zero;
    const Wide velocity = along(row, part, pair) + (isApart ? apart : pushed);
    const Wide inverse = load(row.inverse, part) * (isSoft ? soft.mass : fill(1));
    const Wide wanted =
        before - velocity * inverse - (before - load(row.softness, part)) * (isSoft ? soft.yield : zero);
    const Wide after = larger(wanted, zero);
    store(row.impulse, part, after);
    apply(row, part, after - before, mass, pair);
}

[[gnu::always_inline]] inline void noteImpulse(const RowBlock& normal, int part, PushBlock& push)
{
    const Wide impulse = load(normal.impulse, part);
    store(push.target, part, larger(load(push.target, part), impulse));
    store(push.impulse, part, load(push.impulse, part) + impulse);
}

/// Two directions of sliding friction together, so that it is the same in all directions.
[[gnu::always_inline]] inline void solveSliding(RowBlock* rows, int part, Wide pressed, const PairMass& mass,
                                                PairMotion& pair)
{
    Wide before[2], wanted[2];
    for (int i = 0; i < 2; ++i)
    {
        before[i] = load(rows[i].impulse, part);
        wanted[i] = wantedImpulse(rows[i], part, load(rows[i].target, part), before[i], pair);
    }
    const Wide most = load(rows[0].bound, part) * pressed;
    const Wide square = wanted[0] * wanted[0] + wanted[1] * wanted[1];
    const WideMask slides = square > most * most;
    const Wide scaling = slides ? most / root(slides ? square : fill(1)) : fill(1);
    for (int i = 0; i < 2; ++i)
    {
        const Wide after = wanted[i] * scaling;
        store(rows[i].impulse, part, after);
        apply(rows[i], part, after - before[i], mass, pair);
    }
}

[[gnu::always_inline]] inline void solveSoftFriction(const SolverStep& step, const PointRows& point,
                                                     RowBlock* rows, int part, const PairMass& mass,
                                                     PairMotion& pair)
{
    const Wide pressed = load(rows[point.first].impulse, part);
    solveSliding(rows + point.first + 1, part, pressed, mass, pair);
    if (point.turns)
        solveTurning(rows + point.first + 3, part, lesser(pressed, fill(step.share)), mass, pair,
                     [](Wide, const RowBlock&) {});
}

void solveSoftBlock(const SolverStep& step, const SoftStep& substep, const ContactBlock& block,
                    RowBlock* rows, PushBlock* pushes, const SolverMotion* moved, SolverMotion* motions)
{
    const auto solvePart = [&](int part, const PairMass& mass, PairMotion& pair)
    {
        const WideSoftness soft = softnessOf(substep, mass);
        const PairMotion way = readPair(moved, block.bodies, part);
        for (int sweep = 0; sweep < kSweeps; ++sweep)
        {
            for (int k = 0; k < block.points; ++k)
            {
                RowBlock& normal = rows[block.rows[k].first];
                solveSoftNormal(substep, soft, part, way, mass, normal, pair);
                if (!substep.pushes && sweep + 1 == kSweeps)
                    noteImpulse(normal, part, pushes[block.rows[k].push]);
            }
            // After the normals, so that friction ends within its bound.
            for (int k = 0; k < block.points; ++k)
                solveSoftFriction(step, block.rows[k], rows, part, mass, pair);
        }
    };
    forEachPart(block.bodies, motions, solvePart);
}

void solveSoft(const SolverStep& step, const SoftStep& substep, const ContactBlock* blocks, std::size_t count,
               RowBlock* rows, PushBlock* pushes, const SolverMotion* moved, SolverMotion* motions)
{
    // One after the other: two side by side need more registers than there are.
    for (std::size_t i = 0; i < count; ++i)
        solveSoftBlock(step, substep, blocks[i], rows, pushes, moved, motions);
}

void bounce(const ContactBlock& block, RowBlock* rows, PushBlock* pushes, SolverMotion* motions)
{
    const auto bouncePart = [&](int part, const PairMass& mass, PairMotion& pair)
    {
        const Wide zero{};
        for (int k = 0; k < block.points; ++k)
        {
            RowBlock& row = rows[block.rows[k].first];
            PushBlock& push = pushes[block.rows[k].push];
            const Wide speed = load(row.bound, part), before = load(row.impulse, part);
            const WideMask bounces = (speed > zero) & (load(push.target, part) > zero);
            const Wide wanted = before + (speed - along(row, part, pair)) * load(row.inverse, part);
            const Wide after = bounces ? larger(wanted, zero) : before;
            store(row.impulse, part, after);
            store(push.impulse, part, load(push.impulse, part) + (after - before));
            apply(row, part, after - before, mass, pair);
        }
    };
    forEachPart(block.bodies, motions, bouncePart);
}

constexpr RowKernels kKernels = {readPoints, setUp,         press,       rub,       setUpJoints, solveJoints,
                                 push,       applyContacts, applyJoints, solveSoft, bounce};
}  // namespace
}  // namespace CULLET_PRECISION
}  // namespace cullet
