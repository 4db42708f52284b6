// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

/// Pairs of posed hulls at chosen gaps, single and along trajectories, for the queries' tests and benchmark.
namespace cullet
{
template <class S>
struct Pose
{
    Eigen::Matrix<S, 3, 3> basis;
    Eigen::Matrix<S, 3, 1> origin;
};

template <class S>
struct PairScene
{
    const Hull<S>* hullA;
    const Hull<S>* hullB;
    Pose<S> a, b;

    PosedHull<S> posedA() const { return {*hullA, a.basis, a.origin}; }
    PosedHull<S> posedB() const { return {*hullB, b.basis, b.origin}; }
};

template <class S>
Pose<S> poseOf(const Eigen::Matrix3d& basis, const Eigen::Vector3d& origin)
{
    return {basis.cast<S>(), origin.cast<S>()};
}

/// Moves B so that the distance is about `gap`; for a negative gap so deep that no direction has a larger gap.
template <class S>
void setGap(PairScene<S>& scene, double gap, std::mt19937& engine)
{
    const Eigen::Vector3d away = randomDirection(engine);
    const Eigen::Vector3d home = scene.a.origin.template cast<double>();
    // This distance exceeds the size of the shapes.
    scene.b.origin = (home + 4.0 * away).template cast<S>();
    GjkCache<double> cache;
    const PosedHull<S> a = scene.posedA();
    const PosedHull<S> b = scene.posedB();
    const GjkResult<double> far = gjkDistance(a, b, std::numeric_limits<double>::infinity(), cache);
    // Along its axis the distance shrinks one to one until the shapes touch.
    const Eigen::Vector3d shift = far.axis * (far.distance - gap);
    scene.b.origin = (scene.b.origin.template cast<double>() + shift).template cast<S>();
}

template <class S>
PairScene<S> randomPair(const Hull<S>& hullA, const Hull<S>& hullB, double gap, double farAway,
                        std::mt19937& engine)
{
    PairScene<S> scene;
    scene.hullA = &hullA;
    scene.hullB = &hullB;
    // Every fourth pair is aligned: faces and edges in parallel.
    const bool isAligned = engine() % 4 == 0;
    const Eigen::Matrix3d turn = isAligned ? Eigen::Matrix3d::Identity() : randomRotation(engine);
    scene.a = poseOf<S>(turn, farAway * randomDirection(engine));
    scene.b = poseOf<S>(isAligned ? turn : randomRotation(engine), Eigen::Vector3d::Zero());
    setGap(scene, gap, engine);
    return scene;
}

/// Moves B by up to 3 degrees and `step` length units.
template <class S>
void perturb(PairScene<S>& scene, double step, std::mt19937& engine)
{
    std::uniform_real_distribution<double> angle(0.017, 0.05);
    // In the order in which GCC evaluates arguments, which recorded counts rely on.
    const Eigen::Vector3d axis = randomDirection(engine);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle(engine), axis).toRotationMatrix();
    const Eigen::Quaterniond q((turn * scene.b.basis.template cast<double>()).eval());
    scene.b.basis = q.normalized().toRotationMatrix().template cast<S>();
    scene.b.origin += (step * randomDirection(engine)).template cast<S>();
}

/// Moves B to a gap along the axis of the distance measured a little farther out.
template <class S>
void setGapOutwards(PairScene<S>& scene, double gap)
{
    const Eigen::Vector3d home = scene.b.origin.template cast<double>();
    const Eigen::Vector3d away = (home - scene.a.origin.template cast<double>()).normalized();
    // The first step suffices, except for large and thin shapes.
    for (const double step : {0.3, 1.0, 4.0})
    {
        scene.b.origin = (home + step * away).template cast<S>();
        GjkCache<double> cache;
        const GjkResult<double> far =
            gjkDistance(scene.posedA(), scene.posedB(), std::numeric_limits<double>::infinity(), cache);
        if (far.state != GjkState::Near)
            continue;
        scene.b.origin += ((far.distance - gap) * far.axis).template cast<S>();
        return;
    }
}
}  // namespace cullet
