// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// RowKernels for the register that CULLET_SOLVER_REGISTER names, with internal linkage.
#include "cullet/plugin/solver/point_source.h"
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/plugin/solver/wide.inl"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// How often an iteration solves a block's rows, which lie in the nearest cache then: the points of a manifold depend on
/// each other most. Two sweeps cost an eighth more than one, and leave a pile a third less of its motion.
constexpr int kSweeps = 2;

/// The motions of a block's bodies.
struct PairMotion
{
    Wide3 linearA, angularA, linearB, angularB;
};

[[gnu::always_inline]] inline void readMotion(const SolverMotion* motions, const std::uint32_t* bodies,
                                              Wide3& linear, Wide3& angular)
{
    const btScalar* from[kLanes];
    for (int i = 0; i < kLanes; ++i)
        from[i] = motions[bodies[i]].linear;
    const WideQuad first = WideRecords::read(from);
    for (int i = 0; i < kLanes; ++i)
        from[i] = motions[bodies[i]].angular;
    const WideQuad second = WideRecords::read(from);
    linear = {first.a, first.b, first.c};
    angular = {second.a, second.b, second.c};
}

[[gnu::always_inline]] inline void writeMotion(const Wide3& linear, const Wide3& angular, unsigned lanes,
                                               const std::uint32_t* bodies, SolverMotion* motions)
{
    btScalar* to[kLanes];
    for (int i = 0; i < kLanes; ++i)
        to[i] = motions[bodies[i]].linear;
    WideRecords::write({linear.x, linear.y, linear.z, Wide{}}, to, lanes);
    for (int i = 0; i < kLanes; ++i)
        to[i] = motions[bodies[i]].angular;
    WideRecords::write({angular.x, angular.y, angular.z, Wide{}}, to, lanes);
}

[[gnu::always_inline]] inline PairMotion readPair(const SolverMotion* motions, const BlockBodies& bodies,
                                                  int part)
{
    PairMotion pair;
    readMotion(motions, bodies.a + part * kLanes, pair.linearA, pair.angularA);
    readMotion(motions, bodies.b + part * kLanes, pair.linearB, pair.angularB);
    return pair;
}

[[gnu::always_inline]] inline void writePair(const PairMotion& pair, const BlockBodies& bodies, int part,
                                             SolverMotion* motions)
{
    writeMotion(pair.linearA, pair.angularA, unsigned(bodies.movesA) >> (part * kLanes),
                bodies.a + part * kLanes, motions);
    writeMotion(pair.linearB, pair.angularB, unsigned(bodies.movesB) >> (part * kLanes),
                bodies.b + part * kLanes, motions);
}

/// The inverse masses of a part of a block.
struct PairMass
{
    Wide3 a, b;
};

[[gnu::always_inline]] inline void apply(const RowBlock& row, int part, Wide impulse, const PairMass& mass,
                                         PairMotion& pair)
{
    const Wide3 force = load(row.direction, part) * impulse;
    pair.linearA = pair.linearA + scale(force, mass.a);
    pair.linearB = pair.linearB - scale(force, mass.b);
    pair.angularA = pair.angularA + load(row.turnA, part) * impulse;
    pair.angularB = pair.angularB + load(row.turnB, part) * impulse;
}

/// The velocity along a row.
[[gnu::always_inline]] inline Wide along(const RowBlock& row, int part, const PairMotion& pair)
{
    return dot(load(row.direction, part), pair.linearA - pair.linearB) +
           dot(load(row.armA, part), pair.angularA) + dot(load(row.armB, part), pair.angularB);
}

/// Changes a row's impulse so that its target is reached, within bounds, and applies the change.
///
/// @return the change
[[gnu::always_inline]] inline Wide solveRow(RowBlock& row, int part, Wide least, Wide most,
                                            const PairMass& mass, PairMotion& pair)
{
    const Wide before = load(row.impulse, part);
    const Wide wanted = before + (load(row.target, part) - before * load(row.softness, part) -
                                  along(row, part, pair) * load(row.inverse, part));
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

/// What setting up rows needs of the bodies of one side.
struct Side
{
    Wide3 linear, angular, force, torque, centre;
    Wide3 inverseMass;  ///< along each axis
    Wide mass;          ///< inverse, for the denominators
    Wide3 factor;       ///< angular
    Wide xx, xy, xz, yy, yz, zz;

    /// Change of the angular velocity by a torque impulse, with the angular factor.
    [[gnu::always_inline]] Wide3 turn(const Wide3& arm) const { return scale(freeTurn(arm), factor); }
    [[gnu::always_inline]] Wide3 freeTurn(const Wide3& arm) const
    {
        return {xx * arm.x + xy * arm.y + xz * arm.z, xy * arm.x + yy * arm.y + yz * arm.z,
                xz * arm.x + yz * arm.y + zz * arm.z};
    }
};

[[gnu::always_inline]] inline WideQuad readQuad(const SolverBodyState* states, const std::uint32_t* bodies,
                                                int quad)
{
    const btScalar* from[kLanes];
    for (int i = 0; i < kLanes; ++i)
        from[i] = reinterpret_cast<const btScalar*>(states + bodies[i]) + 4 * quad;
    return WideRecords::read(from);
}

inline void readSide(const SolverBodyState* states, const std::uint32_t* bodies, Side& side)
{
    const WideQuad linear = readQuad(states, bodies, 0), angular = readQuad(states, bodies, 1);
    const WideQuad force = readQuad(states, bodies, 2), torque = readQuad(states, bodies, 3);
    const WideQuad centre = readQuad(states, bodies, 4), first = readQuad(states, bodies, 5);
    const WideQuad second = readQuad(states, bodies, 6);
    side.linear = {linear.a, linear.b, linear.c};
    side.angular = {angular.a, angular.b, angular.c};
    side.force = {force.a, force.b, force.c};
    side.torque = {torque.a, torque.b, torque.c};
    side.centre = {centre.a, centre.b, centre.c};
    side.inverseMass = {linear.d, angular.d, force.d};
    side.mass = torque.d;
    side.factor = {centre.d, first.d, second.d};
    side.xx = first.a;
    side.xy = first.b;
    side.xz = first.c;
    side.yy = second.a;
    side.yz = second.b;
    side.zz = second.c;
}

/// A part of the k-th points of a block, seen from the bodies.
struct PointArms
{
    Wide3 a, b;  ///< from the centres of mass
};

[[gnu::always_inline]] inline PointArms armsOf(const PointSource& source, int part, const Side& a,
                                               const Side& b)
{
    return {load(source.positionA, part) - a.centre, load(source.positionB, part) - b.centre};
}

/// Bullet's btPlaneSpace1() in each lane: two directions beside a normal.
[[gnu::always_inline]] inline void planeSpace(const Wide3& normal, Wide3& first, Wide3& second)
{
    const Wide zero{};
    const WideMask isSteep = (normal.z < zero ? -normal.z : normal.z) > fill(SIMDSQRT12);
    const Wide steep = normal.y * normal.y + normal.z * normal.z;
    const Wide level = normal.x * normal.x + normal.y * normal.y;
    const Wide square = isSteep ? steep : level;
    const Wide length = root(square > zero ? square : fill(1));
    const Wide inverse = fill(1) / length;
    const Wide3 whenSteep = {zero, -normal.z * inverse, normal.y * inverse};
    const Wide3 whenLevel = {-normal.y * inverse, normal.x * inverse, zero};
    first = choose(isSteep, whenSteep, whenLevel);
    const Wide3 secondSteep = {square * inverse, -normal.x * first.z, normal.x * first.y};
    const Wide3 secondLevel = {-normal.z * first.y, normal.z * first.x, square * inverse};
    second = choose(isSteep, secondSteep, secondLevel);
}

[[gnu::always_inline]] inline Wide3 unit(const Wide3& v)
{
    const Wide square = dot(v, v);
    return v * (fill(1) / root(square > Wide{} ? square : fill(1)));
}

/// Directions of sliding friction: along the velocity, or any where that is too small.
inline void chooseSlides(const SolverStep& step, PointSource& source, int part, const Side& a, const Side& b)
{
    const PointArms arms = armsOf(source, part, a, b);
    const Wide3 normal = load(source.normal, part);
    Wide3 first, second;
    planeSpace(normal, first, second);
    store(source.isSliding, part, Wide{});
    if (step.slidesAlongVelocity)
    {
        const Wide3 velocity = a.linear + cross(a.angular, arms.a) - (b.linear + cross(b.angular, arms.b));
        const Wide3 sliding = velocity - normal * dot(normal, velocity);
        const WideMask slides = dot(sliding, sliding) > fill(SIMD_EPSILON);
        const Wide3 along = unit(sliding);
        store(source.isSliding, part, slides ? fill(1) : Wide{});
        first = choose(slides, along, first);
        second = choose(slides, unit(cross(along, normal)), second);
    }
    store(source.slide[0], part, first);
    store(source.slide[1], part, second);
}

/// What all rows of a point have in common.
struct RowPlace
{
    int part;
    const Side& a;
    const Side& b;
    PointArms arms;
    WideMask isLive;
};

/// Sets all of a row but target, impulse and bound.
///
/// @param softness in 1 / mass
/// @return its inverse mass, the row's member `inverse`
[[gnu::always_inline]] inline Wide setUpRow(const RowPlace& at, const Wide3& direction, const Wide3& armA,
                                            const Wide3& armB, Wide relaxation, Wide softness, Wide masses,
                                            RowBlock& row)
{
    const Wide3 turnA = at.a.turn(armA), turnB = at.b.turn(armB);
    const Wide sum = masses + dot(armA, turnA) + dot(armB, turnB) + softness;
    const WideMask exists = at.isLive & (sum > Wide{});
    const Wide inverse = exists ? relaxation / (exists ? sum : fill(1)) : Wide{};
    store(row.direction, at.part, direction);
    store(row.armA, at.part, armA);
    store(row.armB, at.part, armB);
    store(row.turnA, at.part, scale(turnA, at.a.factor));
    store(row.turnB, at.part, scale(turnB, at.b.factor));
    store(row.inverse, at.part, inverse);
    store(row.softness, at.part, softness * inverse);
    return inverse;
}

/// The speed with which points touch that approach with `speed` now, and whose forces add `added` in the step. Steps of
/// Bullet's kind are half of that behind what the way of a fall says, and are so again when the body rises.
[[gnu::always_inline]] inline Wide speedAtTouch(Wide speed, Wide added, Wide gap, Wide inverseTime)
{
    const Wide zero{}, one = fill(1);
    const Wide steps = speed > zero ? gap * inverseTime / (speed > zero ? speed : one) : zero;
    return speed + added * (lesser(larger(steps, zero), one) + fill(btScalar(0.5)));
}

/// The speed with which points must leave to rise as if they had left the place where they touched with `rebound`: they may
/// have overlapped by as much as they approach in a step, half of which the push of the soft contact makes good.
[[gnu::always_inline]] inline Wide speedFromTouch(Wide rebound, Wide speed, Wide added, Wide gap,
                                                  Wide inverseTime)
{
    const Wide zero{};
    const Wide depth = lesser(larger(-gap, zero), larger(speed, zero) / inverseTime);
    const Wide height = larger(-added * inverseTime, zero) * depth;
    return root(rebound * rebound + height) - added * fill(btScalar(0.5));
}

[[gnu::always_inline]] inline void setUpNormal(const SolverStep& step, const PointSource& source,
                                               const RowPlace& at, RowBlock& row, PushBlock* push)
{
    const Wide zero{};
    const Wide3 normal = load(source.normal, at.part);
    const Wide3 armA = cross(at.arms.a, normal), armB = cross(normal, at.arms.b);
    const Wide inverse = setUpRow(at, normal, armA, armB, fill(step.relaxation),
                                  load(source.softness, at.part), at.a.mass + at.b.mass, row);
    const Wide velocity =
        dot(normal, at.a.linear - at.b.linear) + dot(armA, at.a.angular) + dot(armB, at.b.angular);
    const Wide ofForces =
        dot(normal, at.a.force - at.b.force) + dot(armA, at.a.torque) + dot(armB, at.b.torque);
    const Wide before = velocity - ofForces;
    const Wide gap = load(source.gap, at.part), time = fill(step.inverseTime);
    const WideMask bounces = (before < zero ? -before : before) >= fill(step.bounceAbove);
    const Wide approach = step.isSoft ? speedAtTouch(-before, -ofForces, gap, time) : -before;
    const Wide rebound = larger(approach * load(source.restitution, at.part), zero);
    const Wide leaving = step.isSoft ? speedFromTouch(rebound, -before, ofForces, gap, time) : rebound;
    const WideMask rebounds = bounces & (rebound > zero);
    const Wide bounce = rebounds ? leaving : zero;
    const Wide wanted = bounce - velocity - larger(gap, zero) * time;
    const Wide apart = -lesser(gap, zero) * load(source.errorReduction, at.part) * time;
    const WideMask isDeep = at.isLive & (gap <= fill(step.pushBelow));
    store(row.impulse, at.part, load(source.impulse, at.part) * fill(step.warmStart * step.share));
    store(row.bound, at.part, bounce);
    store(row.target, at.part, step.isSoft ? gap : (wanted + (isDeep ? zero : apart)) * inverse);
    if (push != nullptr)
    {
        const WideMask isPushed = isDeep & (step.isSoft ? zero != zero : zero == zero);
        store(push->target, at.part, isPushed ? apart * inverse : zero);
        store(push->impulse, at.part, zero);
    }
}

[[gnu::always_inline]] inline void setUpSlide(const SolverStep& step, const PointSource& source,
                                              const RowPlace& at, int index, RowBlock& row)
{
    const Wide3 direction = load(source.slide[index], at.part);
    const Wide3 armA = cross(at.arms.a, direction), armB = cross(direction, at.arms.b);
    const Wide inverse =
        setUpRow(at, direction, armA, armB, fill(step.relaxation), Wide{}, at.a.mass + at.b.mass, row);
    const Wide velocity =
        dot(direction, at.a.linear - at.b.linear) + dot(armA, at.a.angular) + dot(armB, at.b.angular);
    Wide wanted = step.isSoft ? Wide{} : -velocity;
    if (source.hasDirections)
    {
        const Wide way = dot(load(source.positionA, at.part) - load(source.positionB, at.part), direction);
        wanted = load(source.slideVelocity[index], at.part) + wanted -
                 way * fill(step.anchorVelocity) * load(source.anchor, at.part);
        store(row.softness, at.part, load(source.slideSoftness, at.part));
    }
    store(row.target, at.part, wanted * inverse);
    store(row.impulse, at.part,
          step.isSoft ? dot(load(source.slideImpulse, at.part), direction) * fill(step.warmStart * step.share)
                      : Wide{});
    store(row.bound, at.part, load(source.friction, at.part));
}

/// @param axis    of a unit's length, or zero
/// @param exists  the lanes that have such friction
[[gnu::always_inline]] inline void setUpTurn(const SolverStep& step, const RowPlace& at, const Wide3& axis,
                                             Wide coefficient, RowBlock& row)
{
    const Wide zero{};
    const Wide3 none = {zero, zero, zero};
    const Wide3 armA = none - axis;
    const Wide inverse = setUpRow(at, none, armA, axis, fill(1), zero, zero, row);
    const Wide velocity = dot(armA, at.a.angular) + dot(axis, at.b.angular);
    store(row.target, at.part, step.isSoft ? zero : -velocity * inverse);
    store(row.impulse, at.part, zero);
    store(row.bound, at.part, coefficient);
}

inline void setUpPoint(const SolverStep& step, const PointSource& source, const PointRows& point,
                       const RowPlace& at, RowBlock* rows, PushBlock* pushes)
{
    RowBlock* row = rows + point.first;
    setUpNormal(step, source, at, *row++, point.push != PointRows::kNoPush ? pushes + point.push : nullptr);
    for (int i = 0; i < step.slidingRows; ++i)
        setUpSlide(step, source, at, i, *row++);
    if (!point.turns)
        return;
    const Wide spinning = load(source.spinning, at.part), rolling = load(source.rolling, at.part);
    const WideMask turns = at.isLive & (rolling > Wide{});
    const RowPlace turning{at.part, at.a, at.b, at.arms, turns};
    setUpTurn(step, turning, load(source.normal, at.part), spinning, *row++);
    for (int i = 0; i < 2; ++i)
        setUpTurn(step, turning, load(source.roll[i], at.part), rolling, *row++);
}

inline PairMass massesOf(const BlockBodies& bodies, int part)
{
    return {load(bodies.inverseMassA, part), load(bodies.inverseMassB, part)};
}

inline void applyWarmStart(const ContactBlock& block, const RowBlock* rows, SolverMotion* motions)
{
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
        for (int k = 0; k < block.points; ++k)
        {
            const RowBlock& row = rows[block.rows[k].first];
            apply(row, part, load(row.impulse, part), mass, pair);
        }
        writePair(pair, block.bodies, part, motions);
    }
}

void setUp(const SolverStep& step, const SolverBodyState* states, ContactBlock& block, PointSource* sources,
           RowBlock* rows, PushBlock* pushes, SolverMotion* motions)
{
    Side a[kParts], b[kParts];
    for (int part = 0; part < kParts; ++part)
    {
        readSide(states, block.bodies.a + part * kLanes, a[part]);
        readSide(states, block.bodies.b + part * kLanes, b[part]);
        store(block.bodies.inverseMassA, part, a[part].inverseMass);
        store(block.bodies.inverseMassB, part, b[part].inverseMass);
    }
    for (int k = 0; k < block.points; ++k)
    {
        PointSource& source = sources[k];
        for (int part = 0; part < kParts; ++part)
            chooseSlides(step, source, part, a[part], b[part]);
        finishSlides(step, source);
        for (int part = 0; part < kParts; ++part)
        {
            const RowPlace at{part, a[part], b[part], armsOf(source, part, a[part], b[part]),
                              load(source.isLive, part) > Wide{}};
            setUpPoint(step, source, block.rows[k], at, rows, pushes);
        }
    }
    if (step.warmStart != 0 && !step.isSoft)
        applyWarmStart(block, rows, motions);
}

/// Calls solvePoint(point, part, mass, pair, note) for the points of a block, in sweeps.
///
/// @param note  to be called with the change of each row and the row
template <bool kNotesResidual, class SolvePoint>
[[gnu::always_inline]] inline btScalar sweepPoints(const ContactBlock& block, SolverMotion* motions,
                                                   const SolvePoint& solvePoint)
{
    Wide residual{};
    for (int part = 0; part < kParts; ++part)
    {
        const auto note = [&](Wide change, const RowBlock& row)
        {
            if constexpr (kNotesResidual)
                noteResidual(change, load(row.inverse, part), residual);
        };
        const PairMass mass = massesOf(block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
        for (int sweep = 0; sweep < kSweeps; ++sweep)
        {
            for (int k = 0; k < block.points; ++k)
                solvePoint(block.rows[k], part, mass, pair, note);
        }
        writePair(pair, block.bodies, part, motions);
    }
    return kNotesResidual ? largestLane(residual) : 0;
}

template <bool kNotesResidual>
btScalar pressBlock(const ContactBlock& block, RowBlock* rows, SolverMotion* motions)
{
    const auto press =
        [rows](const PointRows& point, int part, const PairMass& mass, PairMotion& pair, const auto& note)
    {
        RowBlock& normal = rows[point.first];
        note(solveRow(normal, part, Wide{}, fill(btScalar(BT_LARGE_FLOAT)), mass, pair), normal);
    };
    return sweepPoints<kNotesResidual>(block, motions, press);
}

template <bool kNotesResidual>
btScalar rubBlock(const SolverStep& step, const ContactBlock& block, RowBlock* rows, SolverMotion* motions)
{
    const auto rub = [&step, rows](const PointRows& point, int part, const PairMass& mass, PairMotion& pair,
                                   const auto& note)
    { solveFriction(step, point, rows, part, mass, pair, note); };
    return sweepPoints<kNotesResidual>(block, motions, rub);
}

btScalar press(const SolverStep& step, const ContactBlock& block, RowBlock* rows, SolverMotion* motions)
{
    return step.notesResidual ? pressBlock<true>(block, rows, motions)
                              : pressBlock<false>(block, rows, motions);
}

btScalar rub(const SolverStep& step, const ContactBlock& block, RowBlock* rows, SolverMotion* motions)
{
    return step.notesResidual ? rubBlock<true>(step, block, rows, motions)
                              : rubBlock<false>(step, block, rows, motions);
}

/// As solveRow() for the velocity that only moves bodies apart.
[[gnu::always_inline]] inline Wide pushRow(const RowBlock& row, int part, PushBlock& push,
                                           const PairMass& mass, PairMotion& pair)
{
    const Wide zero{}, before = load(push.impulse, part), target = load(push.target, part);
    const Wide wanted = before + (target - before * load(row.softness, part) -
                                  along(row, part, pair) * load(row.inverse, part));
    const Wide after = target != zero ? larger(wanted, zero) : zero;
    store(push.impulse, part, after);
    apply(row, part, after - before, mass, pair);
    return after - before;
}

btScalar push(const ContactBlock& block, const RowBlock* rows, PushBlock* pushes, SolverMotion* motions)
{
    Wide residual{};
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
        for (int k = 0; k < block.points; ++k)
        {
            const PointRows& point = block.rows[k];
            if (point.push == PointRows::kNoPush)
                continue;
            const RowBlock& row = rows[point.first];
            noteResidual(pushRow(row, part, pushes[point.push], mass, pair), load(row.inverse, part),
                         residual);
        }
        writePair(pair, block.bodies, part, motions);
    }
    return largestLane(residual);
}

void setUpJointRow(const SolverStep& step, const Side& a, const Side& b, Wide damping, int part,
                   JointRowBlock& row)
{
    const Wide3 linearA = load(row.linearA, part), armA = load(row.armA, part);
    const Wide3 linearB = load(row.linearB, part), armB = load(row.armB, part);
    const Wide3 turnA = a.turn(armA), turnB = b.turn(armB);
    const Wide sum =
        dot(linearA, linearA) * a.mass + dot(turnA, armA) + dot(linearB, linearB) * b.mass + dot(turnB, armB);
    const WideMask exists = sum > fill(SIMD_EPSILON);
    const Wide inverse = exists ? fill(1) / (exists ? sum : fill(1)) : Wide{};
    const Wide velocity =
        dot(linearA, a.linear) + dot(armA, a.angular) + dot(linearB, b.linear) + dot(armB, b.angular);
    store(row.turnA, part, scale(turnA, a.factor));
    store(row.turnB, part, scale(turnB, b.factor));
    store(row.inverse, part, inverse);
    // In a soft step the rows see the whole velocity, not what has changed.
    const Wide kept = step.isSoft ? velocity - velocity * damping : -velocity * damping;
    const Wide wanted = load(row.target, part);
    store(row.target, part, (wanted + kept) * inverse);
    store(row.relaxed, part, (wanted * load(row.isLasting, part) + kept) * inverse);
    // What removes an error does so in each substep; a motor or spring has its impulse for the whole step.
    const Wide share = load(row.isLasting, part) > Wide{} ? fill(1) : fill(step.share);
    store(row.softness, part, load(row.softness, part) / share);
    store(row.least, part, load(row.least, part) * share);
    store(row.most, part, load(row.most, part) * share);
    store(row.impulse, part, Wide{});
}

void setUpJoints(const SolverStep& step, const SolverBodyState* states, JointBlock& block,
                 JointRowBlock* rows)
{
    for (int part = 0; part < kParts; ++part)
    {
        Side a, b;
        readSide(states, block.bodies.a + part * kLanes, a);
        readSide(states, block.bodies.b + part * kLanes, b);
        store(block.bodies.inverseMassA, part, a.inverseMass);
        store(block.bodies.inverseMassB, part, b.inverseMass);
        for (int i = 0; i < block.rows; ++i)
            setUpJointRow(step, a, b, load(block.damping, part), part, rows[block.first + unsigned(i)]);
    }
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
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        const WideMask active = isActive != nullptr ? load(*isActive, part) > Wide{} : Wide{} == Wide{};
        PairMotion pair = readPair(motions, block.bodies, part);
        for (int i = 0; i < block.rows; ++i)
        {
            JointRowBlock& row = rows[block.first + unsigned(i)];
            const Wide change =
                solveJointRow(row, relaxes ? row.relaxed : row.target, part, active, mass, pair);
            if (step.notesResidual)
                noteResidual(change, load(row.inverse, part), residual);
        }
        writePair(pair, block.bodies, part, motions);
    }
    return largestLane(residual);
}

void applyContacts(const SolverStep& step, const ContactBlock& block, const RowBlock* rows,
                   SolverMotion* motions)
{
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
        for (int k = 0; k < block.points; ++k)
        {
            const PointRows& point = block.rows[k];
            const int count = 1 + step.slidingRows + (point.turns ? 3 : 0);
            for (int i = 0; i < count; ++i)
                apply(rows[point.first + unsigned(i)], part,
                      load(rows[point.first + unsigned(i)].impulse, part), mass, pair);
        }
        writePair(pair, block.bodies, part, motions);
    }
}

void applyJoints(const JointBlock& block, const JointRowBlock* rows, SolverMotion* motions)
{
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
        for (int i = 0; i < block.rows; ++i)
        {
            const JointRowBlock& row = rows[block.first + unsigned(i)];
            const Wide impulse = load(row.isLasting, part) > Wide{} ? Wide{} : load(row.impulse, part);
            applyJoint(row, part, impulse, mass, pair);
        }
        writePair(pair, block.bodies, part, motions);
    }
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
    const WideMask isSoft = isApart ? zero != zero : (substep.pushes ? zero == zero : zero != zero);
    const Wide apart = gap * fill(substep.inverseTime);
    const Wide pushed = isSoft ? larger(gap * soft.approach, fill(-substep.mostPush)) : zero;
    const Wide velocity = along(row, part, pair) + (isApart ? apart : pushed);
    const Wide inverse = load(row.inverse, part) * (isSoft ? soft.mass : fill(1));
    const Wide wanted = before - velocity * inverse - before * (isSoft ? soft.yield : zero);
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
        const RowBlock& row = rows[i];
        before[i] = load(row.impulse, part);
        wanted[i] = before[i] + (load(row.target, part) - before[i] * load(row.softness, part) -
                                 along(row, part, pair) * load(row.inverse, part));
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

void solveSoft(const SolverStep& step, const SoftStep& substep, const ContactBlock& block, RowBlock* rows,
               PushBlock* pushes, const SolverMotion* moved, SolverMotion* motions)
{
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        const WideSoftness soft = softnessOf(substep, mass);
        const PairMotion way = readPair(moved, block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
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
        writePair(pair, block.bodies, part, motions);
    }
}

void bounce(const ContactBlock& block, RowBlock* rows, PushBlock* pushes, SolverMotion* motions)
{
    const Wide zero{};
    for (int part = 0; part < kParts; ++part)
    {
        const PairMass mass = massesOf(block.bodies, part);
        PairMotion pair = readPair(motions, block.bodies, part);
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
        writePair(pair, block.bodies, part, motions);
    }
}

constexpr RowKernels kKernels = {setUp, press,         rub,         setUpJoints, solveJoints,
                                 push,  applyContacts, applyJoints, solveSoft,   bounce};
}  // namespace
}  // namespace CULLET_PRECISION
}  // namespace cullet
