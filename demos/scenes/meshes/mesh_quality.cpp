// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/meshes/mesh_quality.h"

#include "cullet/demos/program/statistics.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kSettling = 60;  ///< steps before bodies slide

std::vector<MeshTrial> makeTrials()
{
    std::vector<MeshTrial> trials;
    for (const double speed : {5.0, 15.0})
    {
        for (const char* shape : {"sphere", "box", "capsule", "cylinder", "hull16", "hull64"})
            trials.push_back({TrialKind::Slide, shape, "flat", speed});
    }
    trials.push_back({TrialKind::Slide, "long-box", "flat-0.25m", 5.0, 4});
    for (const double speed : {6.0, 12.0, 24.0})
    {
        for (const char* shape : {"small-sphere", "small-box"})
            trials.push_back({TrialKind::Shot, shape, "flat", speed, 40, 60});
    }
    for (const char* shape : {"sphere", "box", "capsule", "cylinder", "hull64"})
        trials.push_back({TrialKind::Shot, shape, "needles", 2.0, 30, 90});
    trials.push_back({TrialKind::Shot, "long-box", "needles", 2.0, 12, 90});
    return trials;
}

MeshCase caseOf(const MeshTrial& trial, std::uint64_t seed)
{
    MeshCase meshCase;
    meshCase.shape = trial.shape;
    meshCase.mesh = trial.mesh;
    meshCase.motion = MeshMotion::Free;
    meshCase.bodies = trial.bodies;
    meshCase.apart = trial.shape == "long-box" ? 12 : 3;
    meshCase.seed = seed;
    const double side = meshCase.apart * std::ceil(std::sqrt(trial.bodies));
    // A body that slides must not reach the rim.
    meshCase.reach = side / 2 + 8 + (trial.kind == TrialKind::Slide ? trial.speed * trial.steps / 60.0 : 0.0);
    return meshCase;
}

void start(const MeshTrial& trial, MeshWorld& world, std::uint64_t seed)
{
    if (trial.kind == TrialKind::Slide)
    {
        for (int step = 0; step < kSettling; ++step)
            world.step();
    }
    SplitMix64 random(seed + 1);
    for (std::size_t i = 0; i < world.size(); ++i)
    {
        btRigidBody& body = world.body(i);
        if (trial.kind == TrialKind::Slide)
        {
            const auto yaw = btScalar(random.uniform(0, 6.2831853f));
            body.setLinearVelocity(btVector3(btCos(yaw), 0, btSin(yaw)) * btScalar(trial.speed));
            continue;
        }
        const auto x = btScalar(random.uniform(-0.5f, 0.5f));
        const auto y = btScalar(random.uniform(0.8f, 1.2f));
        const auto z = btScalar(random.uniform(-0.5f, 0.5f));
        body.translate(btVector3(x, y, z));
        body.setInterpolationWorldTransform(body.getWorldTransform());
        body.setLinearVelocity(btVector3(0, -btScalar(trial.speed), 0));
    }
}

double horizontalSpeed(const btRigidBody& body)
{
    const btVector3& velocity = body.getLinearVelocity();
    return std::hypot(double(velocity.x()), double(velocity.z()));
}

BodySummary summaryOf(std::vector<double> bodies)
{
    const Statistics statistics = summarise(std::move(bodies));
    return {statistics.mean, statistics.max};
}
}  // namespace

const char* trialName(TrialKind kind)
{
    return kind == TrialKind::Slide ? "slide" : "shot";
}

const std::vector<MeshTrial>& meshTrials()
{
    static const std::vector<MeshTrial> trials = makeTrials();
    return trials;
}

MeshQuality runTrial(const MeshTrial& trial, const std::string& narrow, std::uint64_t seed)
{
    MeshWorld world(caseOf(trial, seed), narrow);
    start(trial, world, seed);
    std::vector<double> jumps(world.size(), 0.0), slowdowns(world.size(), 0.0), spins(world.size(), 0.0);
    for (int step = 0; step < trial.steps; ++step)
    {
        world.step();
        for (std::size_t i = 0; i < world.size(); ++i)
        {
            jumps[i] = std::max(jumps[i], double(world.body(i).getLinearVelocity().y()));
            spins[i] = std::max(spins[i], double(world.body(i).getAngularVelocity().length()));
        }
    }
    MeshQuality quality;
    for (std::size_t i = 0; i < world.size(); ++i)
    {
        quality.jumped += jumps[i] > 0.1 ? 1 : 0;
        quality.fallen += world.body(i).getWorldTransform().getOrigin().y() < btScalar(-1) ? 1 : 0;
        if (trial.kind == TrialKind::Slide)
            slowdowns[i] = 1.0 - horizontalSpeed(world.body(i)) / trial.speed;
    }
    quality.jump = summaryOf(jumps);
    quality.slowdown = summaryOf(slowdowns);
    quality.spin = summaryOf(spins);
    return quality;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
