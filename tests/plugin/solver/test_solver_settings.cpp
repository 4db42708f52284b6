// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Each field of btContactSolverInfo has its effect, or Bullet's solver solves the group.
#include "cullet/tests/plugin/log_scope.h"
#include "cullet/tests/plugin/solver/solver_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using SetInfo = std::function<void(btContactSolverInfo&)>;

double measureWith(Contender contender, const std::function<double(SolverScene&)>& measure,
                   const SetInfo& set)
{
    SolverScene scene(contender);
    set(scene.info());
    return measure(scene);
}

/// Expects that a change of the settings moves a measure in the same direction as with stock, by at least a share of its
/// effect there.
void expectSameEffect(const std::function<double(SolverScene&)>& measure, const SetInfo& before,
                      const SetInfo& after, std::initializer_list<Contender> contenders, double least = 0.5,
                      double most = 2)
{
    const double stock =
        measureWith(Contender::Stock, measure, after) - measureWith(Contender::Stock, measure, before);
    EXPECT_NE(stock, 0) << "the scene does not depend on the setting";
    for (const Contender contender : contenders)
    {
        const double own = measureWith(contender, measure, after) - measureWith(contender, measure, before);
        EXPECT_GT(own / stock, least) << nameOf(contender) << ", stock's effect " << stock;
        EXPECT_LT(own / stock, most) << nameOf(contender) << ", stock's effect " << stock;
    }
}

constexpr auto kBoth = {Contender::Bullet, Contender::Soft};
constexpr auto kModelBullet = {Contender::Bullet};

/// Largest pivot error of a chain that holds a heavy load after a second.
double chainError(SolverScene& scene)
{
    btSphereShape& bead = scene.shape<btSphereShape>(btScalar(0.1));
    btRigidBody* above = &scene.add(bead, 0, vec(0, 20, 0));
    for (int i = 0; i < 10; ++i)
    {
        btRigidBody& body = scene.add(bead, i == 9 ? 30 : 1, vec(0, 20 - 0.5 * (i + 1), 0));
        body.setActivationState(DISABLE_DEACTIVATION);
        scene.join<btPoint2PointConstraint>(*above, body, vec(0, i == 0 ? 0 : -0.25, 0), vec(0, 0.25, 0));
        above = &body;
    }
    scene.step(30);
    return scene.pivotError();
}

TEST(SolverSettings, IterateAsOftenAsAsked)
{
    expectSameEffect(
        chainError, [](btContactSolverInfo& info) { info.m_numIterations = 4; },
        [](btContactSolverInfo& info) { info.m_numIterations = 100; }, kModelBullet);
}

/// A ball joint whose bodies start apart: what is left of the error after a step.
double errorAfterOneStep(SolverScene& scene)
{
    scene.world().setGravity(vec(0, 0, 0));
    btSphereShape& ball = scene.shape<btSphereShape>(btScalar(0.1));
    btRigidBody& anchor = scene.add(ball, 0, vec(0, 0, 0));
    btRigidBody& body = scene.add(ball, 1, vec(0, -0.6, 0));
    scene.join<btPoint2PointConstraint>(anchor, body, vec(0, -0.25, 0), vec(0, 0.25, 0));
    scene.step();
    return scene.pivotError();
}

TEST(SolverSettings, ReduceErrorOfJointsByErp)
{
    expectSameEffect(
        errorAfterOneStep, [](btContactSolverInfo& info) { info.m_erp = btScalar(0.1); },
        [](btContactSolverInfo& info) { info.m_erp = btScalar(0.6); }, kBoth);
}

/// A box of 1 m starts at a height above the floor: its height after some steps.
double heightOfBoxFrom(SolverScene& scene, double start, int steps)
{
    scene.addFloor();
    btRigidBody& box = scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(0, start, 0));
    box.setActivationState(DISABLE_DEACTIVATION);
    scene.step(steps);
    return heightOfBody(box);
}

/// A box starts 0.1 deep in the floor: its height after some steps.
double riseOfSunkBox(SolverScene& scene)
{
    return heightOfBoxFrom(scene, 0.4, 5);
}

TEST(SolverSettings, PushOverlapsApartByErp2)
{
    expectSameEffect(
        riseOfSunkBox, [](btContactSolverInfo& info) { info.m_erp2 = btScalar(0.05); },
        [](btContactSolverInfo& info) { info.m_erp2 = btScalar(0.4); }, kModelBullet);
}

TEST(SolverSettings, PushOverlapsApartByErpWithoutSplitImpulse)
{
    const auto split = [](btScalar erp)
    {
        return [erp](btContactSolverInfo& info)
        {
            info.m_splitImpulse = false;
            info.m_erp = info.m_erp2 = erp;
        };
    };
    expectSameEffect(riseOfSunkBox, split(btScalar(0.05)), split(btScalar(0.4)), kModelBullet);
}

/// Upward speed of a box that starts deep in the floor.
double speedOfSunkBox(SolverScene& scene)
{
    scene.addFloor();
    btRigidBody& box = scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(0, 0.45, 0));
    box.setActivationState(DISABLE_DEACTIVATION);
    scene.step(2);
    return double(box.getLinearVelocity().y());
}

TEST(SolverSettings, TurnOverlapsIntoSpeedWithoutSplitImpulse)
{
    expectSameEffect(
        speedOfSunkBox, [](btContactSolverInfo& info) { info.m_splitImpulse = true; },
        [](btContactSolverInfo& info) { info.m_splitImpulse = false; }, kModelBullet);
}

TEST(SolverSettings, SplitImpulsesBelowThresholdOnly)
{
    expectSameEffect(
        speedOfSunkBox,
        [](btContactSolverInfo& info) { info.m_splitImpulsePenetrationThreshold = btScalar(-0.02); },
        [](btContactSolverInfo& info) { info.m_splitImpulsePenetrationThreshold = -1; }, kModelBullet);
}

double heightAtRest(SolverScene& scene)
{
    return heightOfBoxFrom(scene, 0.45, 240);
}

TEST(SolverSettings, LeaveOverlapOfLinearSlop)
{
    expectSameEffect(
        heightAtRest, [](btContactSolverInfo& info) { info.m_linearSlop = 0; },
        [](btContactSolverInfo& info) { info.m_linearSlop = btScalar(-0.01); }, kBoth);
    expectSameEffect(
        heightAtRest, [](btContactSolverInfo& info) { info.m_linearSlop = 0; },
        [](btContactSolverInfo& info) { info.m_linearSlop = btScalar(0.01); }, kBoth);
}

TEST(SolverSettings, SoftenContactsByGlobalCfm)
{
    expectSameEffect(
        heightAtRest, [](btContactSolverInfo&) {},
        [](btContactSolverInfo& info) { info.m_globalCfm = btScalar(0.02); }, kModelBullet);
}

TEST(SolverSettings, PullAnchorsBackByFrictionErp)
{
    const auto back = [](SolverScene& scene)
    {
        btRigidBody& floor = scene.addFloor();
        floor.setFriction(1);
        floor.setCollisionFlags(floor.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
        btRigidBody& box = scene.add(scene.box(1, 0.25, 1), 1, vec(0, 0.25, 0));
        box.setActivationState(DISABLE_DEACTIVATION);
        scene.step(10);
        btTransform place = box.getWorldTransform();
        place.setOrigin(place.getOrigin() + vec(0.01, 0, 0));
        box.setWorldTransform(place);
        scene.step(3);
        return double(box.getWorldTransform().getOrigin().x());
    };
    expectSameEffect(
        back, [](btContactSolverInfo& info) { info.m_frictionERP = btScalar(0.05); },
        [](btContactSolverInfo& info) { info.m_frictionERP = btScalar(0.3); }, kBoth);
}

TEST(SolverSettings, DampJoints)
{
    const auto speed = [](SolverScene& scene)
    {
        scene.world().setGravity(vec(0, 0, 0));
        btSphereShape& ball = scene.shape<btSphereShape>(btScalar(0.1));
        btRigidBody& anchor = scene.add(ball, 0, vec(0, 0, 0));
        btRigidBody& body = scene.add(ball, 1, vec(0, -0.5, 0));
        scene.join<btHingeConstraint>(anchor, body, at(0, -0.25, 0), at(0, 0.25, 0));
        body.setLinearVelocity(vec(0, 2, 0));
        scene.step();
        return double(body.getLinearVelocity().y());
    };
    expectSameEffect(
        speed, [](btContactSolverInfo& info) { info.m_damping = 1; },
        [](btContactSolverInfo& info) { info.m_damping = btScalar(0.5); }, kModelBullet);
}

/// Mean sinking of a high stack.
double sinkOfStack(SolverScene& scene)
{
    scene.addFloor();
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    for (int i = 0; i < 8; ++i)
        scene.add(cube, 1, vec(0, 0.5 + i, 0)).setActivationState(DISABLE_DEACTIVATION);
    scene.step(40);
    return 7.5 - heightOfBody(*scene.bodies().back());
}

TEST(SolverSettings, StartWithImpulsesOfLastStep)
{
    expectSameEffect(
        sinkOfStack, [](btContactSolverInfo&) {},
        [](btContactSolverInfo& info) { info.m_solverMode &= ~SOLVER_USE_WARMSTARTING; }, kModelBullet);
    expectSameEffect(
        sinkOfStack, [](btContactSolverInfo&) {},
        [](btContactSolverInfo& info) { info.m_warmstartingFactor = btScalar(0.1); }, kModelBullet);
}

TEST(SolverSettings, RelaxBySor)
{
    // Solver needs fewer iterations.
    expectSameEffect(
        sinkOfStack, [](btContactSolverInfo& info) { info.m_solverMode &= ~SOLVER_USE_WARMSTARTING; },
        [](btContactSolverInfo& info)
        {
            info.m_solverMode &= ~SOLVER_USE_WARMSTARTING;
            info.m_sor = btScalar(0.5);
        },
        kModelBullet, 0.1);
}

TEST(SolverSettings, BounceAboveRestitutionThresholdOnly)
{
    const auto topAfterBounce = [](SolverScene& scene)
    {
        scene.addFloor().setRestitution(1);
        btRigidBody& ball = scene.add(scene.shape<btSphereShape>(btScalar(0.5)), 1, vec(0, 1, 0));
        ball.setRestitution(btScalar(0.8));
        double most = 0;
        for (int i = 0; i < 60; ++i)
        {
            scene.step();
            most = std::max(most, double(ball.getLinearVelocity().y()));
        }
        return most;
    };
    expectSameEffect(
        topAfterBounce, [](btContactSolverInfo&) {},
        [](btContactSolverInfo& info) { info.m_restitutionVelocityThreshold = 10; }, kBoth, 0.8, 1.2);
}

TEST(SolverSettings, StopEarlyAtResidual)
{
    expectSameEffect(
        sinkOfStack, [](btContactSolverInfo&) {},
        [](btContactSolverInfo& info) { info.m_leastSquaresResidualThreshold = btScalar(1e6); }, kModelBullet,
        0.1);
}

TEST(SolverSettings, ReportIterationsUsed)
{
    const auto iterations = [](SolverScene& scene)
    {
        sinkOfStack(scene);
        return double(scene.solver().m_analyticsData.m_numIterationsUsed);
    };
    expectSameEffect(
        iterations, [](btContactSolverInfo& info) { info.m_numIterations = 50; },
        [](btContactSolverInfo& info)
        {
            info.m_numIterations = 50;
            info.m_leastSquaresResidualThreshold = btScalar(1e-3);
        },
        kModelBullet);
}

/// Way of a box that slides until it rests.
double slide(SolverScene& scene)
{
    scene.addFloor().setFriction(1);
    btRigidBody& box = scene.add(scene.box(1, 0.25, 1), 1, vec(0, 0.25, 0));
    box.setFriction(btScalar(0.5));
    box.setLinearVelocity(vec(3, 0, 3));
    scene.step(120);
    const btVector3 place = box.getWorldTransform().getOrigin();
    return std::hypot(double(place.x()), double(place.z()));
}

TEST(SolverSettings, TakeFixedFrictionDirectionsWhenAsked)
{
    expectSameEffect(
        slide, [](btContactSolverInfo&) {},
        [](btContactSolverInfo& info)
        {
            info.m_solverMode |=
                SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
        },
        kModelBullet);
}

TEST(SolverSettings, SlideAsStockWithEachFrictionMode)
{
    for (const int mode : {SOLVER_USE_2_FRICTION_DIRECTIONS | 0,
                           SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS | 0, SOLVER_CACHE_FRIENDLY | 0,
                           SOLVER_FRICTION_SEPARATE | 0, SOLVER_ENABLE_FRICTION_DIRECTION_CACHING | 0})
    {
        SCOPED_TRACE(mode);
        expectAsStock(
            [mode](SolverScene& scene)
            {
                scene.info().m_solverMode |= mode;
                return Measures{equal("way", slide(scene), 0.05)};
            },
            1, kModelBullet);
    }
}

/// How far a row of boxes at rest has gone that a fast one hits, with few iterations.
double pushedRow(SolverScene& scene)
{
    scene.addFloor();
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    for (int i = 0; i < 6; ++i)
    {
        btRigidBody& body = scene.add(cube, 1, vec(i == 0 ? -3.0 : 1.01 * i, 0.5, 0));
        body.setFriction(btScalar(0.6));
        body.setActivationState(DISABLE_DEACTIVATION);
        scene.add(cube, 2, vec(i == 0 ? -3.0 : 1.01 * i, 1.5, 0)).setFriction(btScalar(0.6));
    }
    scene.bodies()[1]->setLinearVelocity(vec(8, 0, 0));
    scene.bodies()[2]->setLinearVelocity(vec(8, 0, 0));
    scene.info().m_numIterations = 2;
    scene.step(60);
    double way = 0;
    for (const auto& body : scene.bodies())
        way += double(body->getWorldTransform().getOrigin().x());
    return way;
}

TEST(SolverSettings, TakeFrictionBetweenNormalsWhenAsked)
{
    const auto interleave = [](btContactSolverInfo& info)
    { info.m_solverMode |= SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS; };
    const auto wayWith = [](Contender contender, const SetInfo& set)
    { return measureWith(contender, pushedRow, set); };
    const double apart = wayWith(Contender::Bullet, [](btContactSolverInfo&) {});
    const double between = wayWith(Contender::Bullet, interleave);
    EXPECT_NE(between, apart);
    EXPECT_NEAR(between, wayWith(Contender::Stock, interleave), 0.05 * std::abs(between));
}

/// Warnings of a world that is made, set and stepped.
std::vector<std::string> warningsOf(Contender contender, const SetInfo& set)
{
    const LogScope log;
    SolverScene scene(contender);
    scene.addFloor();
    scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(0, 0.5, 0));
    set(scene.info());
    scene.step(3);
    return loggedLines();
}

TEST(SolverSettings, WarnOnceOfThoseLeftToBullet)
{
    for (const Contender contender : kBoth)
    {
        const auto warnings = warningsOf(
            contender, [](btContactSolverInfo& info) { info.m_solverMode |= SOLVER_RANDMIZE_ORDER; });
        ASSERT_EQ(warnings.size(), 1u) << nameOf(contender);
        EXPECT_NE(warnings[0].find("SOLVER_RANDMIZE_ORDER"), std::string::npos);
    }
}

TEST(SolverSettings, WarnOnceOfThoseWithoutEffectOnModelSoft)
{
    const std::pair<const char*, SetInfo> settings[] = {
        {"m_erp2", [](btContactSolverInfo& info) { info.m_erp2 = btScalar(0.3); }},
        {"m_globalCfm of contacts", [](btContactSolverInfo& info) { info.m_globalCfm = btScalar(0.1); }},
        {"m_sor", [](btContactSolverInfo& info) { info.m_sor = btScalar(0.9); }},
        {"m_splitImpulse", [](btContactSolverInfo& info) { info.m_splitImpulse = 0; }},
        {"m_splitImpulsePenetrationThreshold",
         [](btContactSolverInfo& info) { info.m_splitImpulsePenetrationThreshold = btScalar(-0.1); }},
        {"m_splitImpulseTurnErp",
         [](btContactSolverInfo& info) { info.m_splitImpulseTurnErp = btScalar(0.2); }},
        {"m_warmstartingFactor", [](btContactSolverInfo& info) { info.m_warmstartingFactor = 1; }},
        {"m_leastSquaresResidualThreshold",
         [](btContactSolverInfo& info) { info.m_leastSquaresResidualThreshold = btScalar(1e-3); }}};
    const std::string start = "Solver: SolverModel::Soft has no use for ";
    std::string names;
    for (const auto& [name, set] : settings)
    {
        const auto warnings = warningsOf(Contender::Soft, set);
        ASSERT_EQ(warnings.size(), 1u) << name;
        EXPECT_EQ(warnings[0], start + name);
        EXPECT_TRUE(warningsOf(Contender::Bullet, set).empty()) << name;
        names += (names.empty() ? "" : ", ") + std::string(name);
    }
    const auto warnings = warningsOf(Contender::Soft,
                                     [&](btContactSolverInfo& info)
                                     {
                                         for (const auto& [name, set] : settings)
                                             set(info);
                                     });
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0], start + names);
    EXPECT_TRUE(
        warningsOf(Contender::Soft, [](btContactSolverInfo& info) { info.m_numIterations = 20; }).empty());
}

/// A chain that lies on a heap.
void buildMixed(SolverScene& scene, bool hasOwnJoint)
{
    scene.addFloor();
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    for (int i = 0; i < 12; ++i)
        scene.add(cube, 1, vec(1.1 * (i % 3), 0.55 + 1.02 * (i / 3), 0.05 * i));
    for (int i = 0; i < 5; ++i)
    {
        btRigidBody& a = *scene.bodies()[std::size_t(2 + i)];
        btRigidBody& b = *scene.bodies()[std::size_t(5 + i)];
        const btVector3 pivot = a.getWorldTransform().inverse() * b.getWorldTransform().getOrigin();
        if (hasOwnJoint && i == 2)
            scene.join<OwnJoint>(a, b, pivot, vec(0, 0, 0));
        else
            scene.join<btPoint2PointConstraint>(a, b, pivot, vec(0, 0, 0));
    }
}

/// Steps the mixed scene with stock and Solver: the same bits, and this refusal.
void expectBulletsBits(SolverRefusal refusal, bool hasOwnJoint,
                       const std::function<void(SolverScene&)>& prepare)
{
    for (const Contender contender : kBoth)
    {
        SolverScene stock(Contender::Stock), own(contender);
        for (SolverScene* scene : {&stock, &own})
            buildMixed(*scene, hasOwnJoint);
        const Solver& solver = static_cast<Solver&>(own.solver());
        for (SolverScene* scene : {&stock, &own})
            prepare(*scene);
        for (int i = 0; i < 60; ++i)
        {
            stock.step();
            own.step();
            ASSERT_EQ(own.hash(), stock.hash()) << nameOf(contender) << ", step " << i;
            ASSERT_EQ(solver.stats().refusal, refusal);
            ASSERT_EQ(solver.stats().refusedGroups, solver.stats().groups);
            ASSERT_GT(solver.stats().groups, 0u);
        }
    }
}

TEST(SolverSettings, LeaveRandomOrderToBullet)
{
    expectBulletsBits(SolverRefusal::RandomOrder, false,
                      [](SolverScene& scene)
                      {
                          scene.info().m_solverMode |= SOLVER_RANDMIZE_ORDER;
                          scene.solver().setRandSeed(7);
                      });
}

TEST(SolverSettings, LeaveJointsOfApplicationToBullet)
{
    expectBulletsBits(SolverRefusal::ForeignJoint, true, [](SolverScene&) {});
}

TEST(SolverSettings, LeaveOnlyIslandsWithJointsOfApplicationToBullet)
{
    for (const Contender contender : kBoth)
    {
        SolverScene scene(contender);
        scene.addFloor();
        btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
        for (int i = 0; i < 6; ++i)
            scene.add(cube, 1, vec(3 * (i / 2), 0.5 + i % 2, 0));
        for (const std::size_t lower : {1, 3, 5})
        {
            btRigidBody &a = *scene.bodies()[lower], &b = *scene.bodies()[lower + 1];
            if (lower == 3)
                scene.join<OwnJoint>(a, b, vec(0, 0.5, 0), vec(0, -0.5, 0));
            else
                scene.join<btPoint2PointConstraint>(a, b, vec(0, 0.5, 0), vec(0, -0.5, 0));
        }
        scene.step(10);
        const SolverStats& stats = static_cast<Solver&>(scene.solver()).stats();
        EXPECT_EQ(stats.refusal, SolverRefusal::ForeignJoint);
        EXPECT_EQ(stats.groups, 2u);  // The other two islands are one.
        EXPECT_EQ(stats.refusedGroups, 1u);
        EXPECT_EQ(stats.joints, 2u);
        EXPECT_EQ(stats.contacts, 2u);
    }
}

/// Calls of a row function that an application sets after the first step.
int callsOfOwnRowFunction(SolverScene& scene)
{
    static btSingleConstraintRowSolver bullets = nullptr;
    static int calls = 0;
    buildMixed(scene, false);
    scene.step(20);
    bullets = scene.solver().getScalarConstraintRowSolverLowerLimit();
    calls = 0;
    scene.solver().setConstraintRowSolverLowerLimit(
        [](btSolverBody& a, btSolverBody& b, const btSolverConstraint& row)
        {
            ++calls;
            return bullets(a, b, row);
        });
    scene.step(2);
    return calls;
}

TEST(SolverSettings, LeaveGroupsToBulletWhenRowFunctionsAreForeign)
{
    for (const Contender contender : kBoth)
    {
        SolverScene scene(contender);
        callsOfOwnRowFunction(scene);
        EXPECT_EQ(static_cast<Solver&>(scene.solver()).stats().refusal, SolverRefusal::ForeignRows);
    }
}

TEST(SolverSettings, CallRowFunctionsOfApplication)
{
    for (const Contender contender : {Contender::Stock, Contender::Bullet, Contender::Soft})
    {
        SolverScene scene(contender);
        EXPECT_GT(callsOfOwnRowFunction(scene), 0) << nameOf(contender);
    }
}

TEST(SolverSettings, CountWhatItSolves)
{
    SolverScene scene(Contender::Bullet);
    buildMixed(scene, false);
    scene.step(30);
    const SolverStats& stats = static_cast<Solver&>(scene.solver()).stats();
    EXPECT_EQ(stats.refusal, SolverRefusal::No);
    EXPECT_EQ(stats.refusedGroups, 0u);
    EXPECT_EQ(stats.groups, 1u);
    EXPECT_EQ(stats.joints, 5u);
    EXPECT_GE(stats.contacts, 3u);
    EXPECT_EQ(stats.serialConstraints, 0u);
}

TEST(SolverSettings, ReplaceOptionsOutOfRange)
{
    SolverOptions options;
    options.substeps = 0;
    options.contactFrequency = -1;
    options.contactDamping = btScalar(NAN);
    options.threads = -3;
    const Solver solver(options);
    EXPECT_GE(solver.options().substeps, 1);
    EXPECT_GT(solver.options().contactFrequency, 0);
    EXPECT_GE(solver.options().contactDamping, 0);
    EXPECT_GE(solver.options().threads, 0);
    options.substeps = 1000;
    EXPECT_LE(Solver(options).options().substeps, 64);
}
}  // namespace
}  // namespace cullet::test
