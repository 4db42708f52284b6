// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/cuda/support/contact_query.h"
#include "cullet/tests/cuda/support/crowd_scene.h"
#include "cullet/tests/cuda/support/host_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cullet::test
{
/// Frames of a crowd that are asked for booleans, then for distances, then for contacts; with the answers of the CPU's
/// executor, also those of a search that has forgotten all pairs in between.
class FramesOfContacts
{
public:
    explicit FramesOfContacts(CrowdScene& scene)
    {
        for (int frame = 0; frame < 8; ++frame)
        {
            m_frames.push_back(scene.poses);
            scene.move(frame == 3 ? 1.0 : 0.02);
        }
        // After a failure all is as in a search that begins there.
        for (std::size_t first = 0; first < size(); ++first)
        {
            HostContacts host(scene.set, contactOptions(PsapExecutor::InOrder, 1));
            std::vector<FoundContacts> answers(size());
            for (std::size_t frame = first; frame < size(); ++frame)
                answers[frame] = answer(host, frame);
            m_expected.push_back(answers);
        }
    }

    std::size_t size() const { return m_frames.size(); }
    const std::vector<BodyPose>& poses(std::size_t frame) const { return m_frames[frame]; }
    ContactQuery query(std::size_t frame) const
    {
        return contactQuery(0.0f, isMeasured(frame) ? kMost : -1.0f, isDeep(frame) ? kMargin : -1.0f);
    }
    FoundContacts answer(HostContacts& host, std::size_t frame) const
    {
        const ContactQuery asked = query(frame);
        return host.query(poses(frame), asked.margin, asked.pairs.maxDistance, asked.pairs.contactMargin);
    }
    /// Answers of a frame after all pairs were forgotten before another one.
    const FoundContacts& expected(std::size_t forgotten, std::size_t frame) const
    {
        return m_expected[forgotten][frame];
    }

    /// Whether all kinds of answers are there.
    void expectVaried() const
    {
        for (std::size_t frame = 0; frame < size(); ++frame)
        {
            const ConvexAnswers& answers = expected(0, frame).answers;
            const auto isNear = [](const PairDistance& found)
            { return found.distance > 0 && found.distance <= kMost; };
            EXPECT_EQ(std::count_if(answers.distances.begin(), answers.distances.end(), isNear) > 30,
                      isMeasured(frame));
            EXPECT_EQ(answers.depths.size() > 50, isDeep(frame));
            EXPECT_EQ(answers.contacts.size() > 50, isDeep(frame));
            EXPECT_GT(answers.overlaps.size(), 50u);
        }
    }

private:
    static constexpr float kMargin = 0.01f, kMost = 0.5f;

    static bool isMeasured(std::size_t frame) { return frame == 4 || frame == 5; }
    static bool isDeep(std::size_t frame) { return frame > 5; }

    std::vector<std::vector<BodyPose>> m_frames;
    std::vector<std::vector<FoundContacts>> m_expected;
};
}  // namespace cullet::test
