// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Setting up the rows of blocks. Internal linkage.
#include "cullet/plugin/solver/row_points.inl"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// The share of its last impulse that a soft contact carries without being pressed in. More makes piles sink less, by that
/// share; from a half on, impulses wander between the points of a manifold, and stacks do not lie still.
constexpr btScalar kCarried = btScalar(0.3);

/// Points of a soft step that are deeper than this, m, begin it with this part of their last impulse, as all do with Bullet's
/// solver. Joints, whose own impulses begin at zero, can press more and more into a contact that they draw together, and
/// shoot the bodies out when its normal has turned: with .95 twice as hard. With .7 a load presses what has a thousandth of its
/// mass through the floor.
constexpr btScalar kDeepGap = btScalar(-0.1), kKeptOfDeep = btScalar(0.85);

/// The share of a joint's correction that bodies keep as velocity after a soft step's relaxation. Without it, chains of
/// bodies with small moments of inertia fall apart, and the sooner the more iterations they have.
constexpr btScalar kKeptCorrection = btScalar(0.5);

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
    const WideMask isKept = (gap > fill(kDeepGap)) | inAllLanes(!step.isSoft);
    const Wide kept = load(source.impulse, at.part) * fill(step.warmStart * step.share);
    store(row.impulse, at.part, isKept ? kept : kept * fill(kKeptOfDeep));
    if (step.isSoft)
        store(row.softness, at.part, load(row.impulse, at.part) * fill(kCarried));
    store(row.bound, at.part, bounce);
    store(row.target, at.part, step.isSoft ? gap : (wanted + (isDeep ? zero : apart)) * inverse);
    if (push != nullptr)
    {
        const WideMask isPushed = isDeep & inAllLanes(!step.isSoft);
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

/// @param at    with the lanes that have such friction
/// @param axis  of a unit's length, or zero
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
        if (source.isPlain)
            writeSlides(source);
        else
            finishSlides(step, source);
        for (int part = 0; part < kParts; ++part)
        {
            const RowPlace at{part, a[part], b[part], armsOf(source, part, a[part], b[part]),
                              load(source.isLive, part) > Wide{}};
            setUpPoint(step, source, block.rows[k], at, rows, pushes);
        }
    }
    if (step.warmStart != 0 && !step.isSoft)
        applyRows(block, rows, motions, [](const PointRows&) { return 1; });
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
    const Wide lasting = larger(fill(kKeptCorrection), load(row.isLasting, part));
    store(row.relaxed, part, (wanted * lasting + kept) * inverse);
    // What removes an error does so in each substep; a motor or spring has its impulse for the whole step.
    const Wide share = load(row.isLasting, part) > Wide{} ? fill(1) : fill(step.share);
    store(row.softness, part, load(row.softness, part) / share);
    store(row.least, part, load(row.least, part) * share);
    store(row.most, part, load(row.most, part) * share);
    store(row.impulse, part, Wide{});
    store(row.sum, part, Wide{});
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
}  // namespace
}  // namespace CULLET_PRECISION
}  // namespace cullet
