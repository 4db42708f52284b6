// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/cuda/narrow/pair_types.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/tests/narrow/shapes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
enum class ConvexKind
{
    Regular,
    Thin,       ///< one of the two is a plate or a needle
    Far,        ///< 10,000 sizes from the origin of the world
    Coincident  ///< the same hull twice in one place, or nearly so; faces and edges level with each other
};

inline constexpr ConvexKind kConvexKinds[] = {ConvexKind::Regular, ConvexKind::Thin, ConvexKind::Far,
                                              ConvexKind::Coincident};

inline std::string nameOfKind(const testing::TestParamInfo<ConvexKind>& info)
{
    const char* const names[] = {"Regular", "Thin", "Far", "Coincident"};
    return names[static_cast<int>(info.param)];
}

/// The input of a query.
struct ConvexBodies
{
    std::vector<BodyPose> poses;
    std::vector<RowPair> pairs;
};

/// Bodies with planted gaps and depths, pair by pair: bodies 2 k and 2 k + 1 are pair k.
class ConvexScene : public ConvexBodies
{
public:
    ConvexScene(ConvexKind kind, std::size_t count, unsigned seed) : m_kind(kind), m_engine(seed)
    {
        addShapes(1.0);
        for (std::size_t k = 0; k < count; ++k)
        {
            plant();
            pairs.push_back({static_cast<std::uint32_t>(2 * k), static_cast<std::uint32_t>(2 * k + 1)});
        }
    }

    /// Turns every second body by 1 to 3 degrees, and moves it by a hundredth, or by that share of both.
    void step(double share = 1.0)
    {
        std::uniform_real_distribution<double> angle(0.017 * share, 0.05 * share);
        for (std::size_t i = 1; i < poses.size(); i += 2)
        {
            BodyPose& pose = poses[i];
            const Eigen::Vector3d axis = randomDirection(m_engine), shift = randomDirection(m_engine);
            const Eigen::Quaterniond turned(Eigen::AngleAxisd(angle(m_engine), axis) * rotationOf(pose));
            setPose(pose, turned, positionOf(pose) + 0.01 * share * shift);
        }
    }

    /// Multiplies all lengths by 2 to that power, which rounds nothing.
    void rescale(int exponent)
    {
        addShapes(std::ldexp(1.0, exponent));
        for (BodyPose& pose : poses)
        {
            for (float& coordinate : pose.position)
                coordinate = std::ldexp(coordinate, exponent);
        }
    }

    PosedHull<double> posed(std::uint32_t body) const
    {
        const BodyPose& pose = poses[body];
        return {exact[pose.hull], rotationOf(pose).normalized().toRotationMatrix(), positionOf(pose)};
    }

    /// The unit of relative tolerances.
    double sizeOf(RowPair pair) const
    {
        const PosedHull<double> a = posed(pair.a), b = posed(pair.b);
        return a.hull().radius() + b.hull().radius() + (a.origin() - b.origin()).norm();
    }

    HullSet set;
    std::vector<Hull<float>> hulls;
    std::vector<Hull<double>> exact;  ///< of the same points

private:
    static Eigen::Quaterniond rotationOf(const BodyPose& pose)
    {
        return {pose.rotation[3], pose.rotation[0], pose.rotation[1], pose.rotation[2]};
    }
    static Eigen::Vector3d positionOf(const BodyPose& pose)
    {
        return {pose.position[0], pose.position[1], pose.position[2]};
    }
    static void setPose(BodyPose& pose, const Eigen::Quaterniond& turn, const Eigen::Vector3d& place)
    {
        for (int i = 0; i < 3; ++i)
            pose.position[i] = static_cast<float>(place[i]);
        for (int i = 0; i < 4; ++i)
            pose.rotation[i] = static_cast<float>(turn.coeffs()[i]);
    }

    void addShapes(double scale)
    {
        set = HullSet();
        hulls.clear();
        exact.clear();
        m_thin.clear();
        m_regular.clear();
        for (const NamedPoints& shape : queryShapes())
            addShape({shape.name, scaled(shape.points, scale), shape.isThin});
    }

    void addShape(const NamedPoints& shape)
    {
        (shape.isThin ? m_thin : m_regular).push_back(static_cast<std::uint32_t>(hulls.size()));
        hulls.push_back(hullOf<float>(shape.points));
        const Hull<float>& corners = hulls.back().corners();
        std::vector<Eigen::Vector3d> points;
        for (std::int32_t i = 0; i < corners.vertexCount(); ++i)
            points.push_back(corners.vertex(i).cast<double>());
        exact.push_back(makeHull(points, HullExtra::None));
        set.add(hulls.back());
    }

    std::uint32_t anyOf(const std::vector<std::uint32_t>& list) { return list[m_engine() % list.size()]; }

    /// Gaps, and depths as negative ones.
    double anyGap()
    {
        constexpr double kGaps[] = {0.06, 0.03, 3e-3, 1e-3, 1e-5, 4e-6, -4e-6, -1e-4, -3e-3, -0.03, -0.2};
        return kGaps[m_engine() % std::size(kGaps)];
    }

    Eigen::Quaterniond anyTurn(bool isAligned)
    {
        return isAligned ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(randomRotation(m_engine));
    }

    void plant()
    {
        BodyPose a = {}, b = {};
        a.hull = anyOf(m_kind == ConvexKind::Thin ? m_thin : m_regular);
        b.hull = m_kind == ConvexKind::Coincident ? a.hull : anyOf(m_regular);
        const double away = m_kind == ConvexKind::Far ? 1e4 : 1.0;
        const bool isAligned = m_kind == ConvexKind::Coincident || m_engine() % 4 == 0;
        const Eigen::Quaterniond turn = anyTurn(false);
        // Quaternions of other lengths than 1 mean the same.
        const double length = std::uniform_real_distribution<double>(0.6, 1.9)(m_engine);
        Eigen::Quaterniond longer = turn;
        longer.coeffs() *= length;
        setPose(a, longer, away * randomDirection(m_engine));
        setPose(b, isAligned ? turn : anyTurn(false), positionOf(a));
        poses.push_back(a);
        poses.push_back(b);
        if (m_kind != ConvexKind::Coincident || m_engine() % 4 != 0)
            setGap(poses[poses.size() - 2], poses.back(), anyGap());
    }

    void setGap(const BodyPose& a, BodyPose& b, double gap)
    {
        const auto posedAs = [&](const BodyPose& pose) -> Pose<double> {
            return {rotationOf(pose).normalized().toRotationMatrix(), positionOf(pose)};
        };
        PairScene<double> scene = {&exact[a.hull], &exact[b.hull], posedAs(a), posedAs(b)};
        cullet::setGap(scene, gap, m_engine);
        setPose(b, rotationOf(b), scene.b.origin);
    }

    ConvexKind m_kind;
    std::mt19937 m_engine;
    std::vector<std::uint32_t> m_regular, m_thin;
};
}  // namespace cullet::test
