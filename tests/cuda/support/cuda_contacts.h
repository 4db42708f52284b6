// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/contacts/contact_finder.h"
#include "cullet/tests/cuda/support/contact_query.h"
#include "cullet/tests/cuda/support/cuda_pairs.h"
#include "cullet/tests/cuda/support/host_contacts.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
/// Contacts on a device, with poses from the CPU.
class CudaContacts
{
public:
    explicit CudaContacts(const HullSet& hulls, const PsapOptions& options = {})
        : m_finder(makeDeviceContactFinder(hulls, options, nullptr, &why))
    {
    }

    bool isThere() const { return m_finder != nullptr; }

    void upload(const std::vector<BodyPose>& poses) { m_poses.upload(poses); }

    /// Without waiting for the answers.
    Status enqueue(const std::vector<BodyPose>& poses, const ContactQuery& query)
    {
        upload(poses);
        return m_finder->enqueue({m_poses.data(), static_cast<std::uint32_t>(poses.size())}, query);
    }
    /// Ok, or the error of the call that has failed.
    Status query(const std::vector<BodyPose>& poses, const ContactQuery& query, FoundContacts& found)
    {
        found = {};
        const Status status = enqueue(poses, query);
        return status == Status::Ok ? collect(found) : status;
    }
    Status collect(FoundContacts& found)
    {
        DeviceContacts contacts;
        ContactCounts counts;
        const Status status = m_finder->collect(contacts, counts);
        const DevicePairAnswers& answers = contacts.answers;
        const auto downloadedIf = [](const auto* from, std::uint64_t count)
        { return downloaded(from, from != nullptr ? count : 0); };
        const std::uint64_t overlapping = counts.pairs.overlapping;
        EXPECT_TRUE(answers.depths == nullptr || answers.room >= overlapping);
        found.pairs = downloaded(contacts.pairs, answers.count);
        found.answers = {
            downloaded(answers.states, answers.count),      downloaded(answers.axes, answers.count),
            downloadedIf(answers.distances, answers.count), downloadedIf(answers.overlaps, overlapping),
            downloadedIf(answers.depths, overlapping),      downloadedIf(answers.contacts, overlapping)};
        found.changes = counts.changes;
        found.counts.overlapping = counts.pairs.overlapping;
        found.counts.invalid = counts.pairs.invalid;
        found.counts.failed = counts.pairs.failed;
        found.counts.remembered = counts.pairs.remembered;
        return status;
    }
    /// The number that ahead() gives, after all work.
    std::uint64_t countAhead() const
    {
        const DeviceContactsAhead ahead = m_finder->ahead();
        EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
        return downloaded(ahead.count, 1)[0];
    }
    void forget() { m_finder->forget(); }

    std::string why;

private:
    std::unique_ptr<DeviceContactFinder> m_finder;
    DeviceArray<BodyPose> m_poses;
};
}  // namespace cullet::test
