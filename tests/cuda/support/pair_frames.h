// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"
#include "cullet/tests/cuda/support/host_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cullet::test
{
enum class PairQuestion
{
    Booleans,
    Contacts,
    Distances
};

/// Frames of pairs that are asked for booleans, then for contacts, then for distances; with the answers of the CPU's executor,
/// also those to pairs that were forgotten in between. A device records launches with the second query of a list for the
/// same, and launches them again with the third.
class FramesOfPairs
{
public:
    explicit FramesOfPairs(ConvexScene& scene)
    {
        for (const std::size_t count : {10, 300, 300, 300, 300, 300, 300, 200})
        {
            m_frames.push_back(scene);
            m_frames.back().pairs.resize(count);
            scene.step();
        }
        // After a failure all is as in queries that begin there.
        for (std::size_t first = 0; first < size(); ++first)
        {
            HostPairs host(scene.set, PsapExecutor::InOrder, 1);
            std::vector<ConvexAnswers> answers(size());
            for (std::size_t frame = first; frame < size(); ++frame)
                answers[frame] = answer(host, frame);
            m_expected.push_back(answers);
        }
    }

    std::size_t size() const { return m_frames.size(); }
    const ConvexBodies& bodies(std::size_t frame) const { return m_frames[frame]; }
    PairQuestion question(std::size_t frame) const
    {
        if (frame + 1 == size())
            return PairQuestion::Distances;
        return frame < 4 ? PairQuestion::Booleans : PairQuestion::Contacts;
    }
    static constexpr float margin() { return 0.02f; }
    static constexpr float mostDistance() { return 1.0f; }

    ConvexAnswers answer(HostPairs& host, std::size_t frame) const
    {
        switch (question(frame))
        {
            case PairQuestion::Booleans:
                return host.query(bodies(frame));
            case PairQuestion::Contacts:
                return host.contacts(bodies(frame), margin());
            case PairQuestion::Distances:
                break;
        }
        return host.measure(bodies(frame), mostDistance());
    }
    /// Answers of a frame to pairs that were forgotten before another one.
    const ConvexAnswers& expected(std::size_t forgotten, std::size_t frame) const
    {
        return m_expected[forgotten][frame];
    }

    /// Whether all kinds of answers are there.
    void expectVaried() const
    {
        for (std::size_t frame = 0; frame < size(); ++frame)
        {
            const ConvexAnswers& answers = expected(0, frame);
            const auto isNear = [](const PairDistance& found)
            { return found.distance > 0 && found.distance <= mostDistance(); };
            EXPECT_EQ(std::count_if(answers.distances.begin(), answers.distances.end(), isNear) > 30,
                      question(frame) == PairQuestion::Distances);
            EXPECT_EQ(answers.depths.size() > 50, question(frame) == PairQuestion::Contacts);
            EXPECT_EQ(answers.contacts.size() > 50, question(frame) == PairQuestion::Contacts);
        }
    }

private:
    std::vector<ConvexBodies> m_frames;
    std::vector<std::vector<ConvexAnswers>> m_expected;
};
}  // namespace cullet::test
