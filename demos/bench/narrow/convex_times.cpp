// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/convex_times.h"

#include "cullet/demos/bench/cuda/support/cuda_timing.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
/// Memory of the device.
template <class T>
class DeviceList
{
public:
    explicit DeviceList(std::size_t count) : m_count(count)
    {
        checkCuda(cudaMalloc(reinterpret_cast<void**>(&m_data), count * sizeof(T)));
    }
    DeviceList(const DeviceList&) = delete;
    DeviceList& operator=(const DeviceList&) = delete;
    ~DeviceList() { cudaFree(m_data); }

    void upload(const std::vector<T>& from)
    {
        checkCuda(cudaMemcpy(m_data, from.data(), m_count * sizeof(T), cudaMemcpyHostToDevice));
        checkCuda(cudaDeviceSynchronize());
    }
    T* data() const { return m_data; }
    std::size_t bytes() const { return m_count * sizeof(T); }

private:
    std::size_t m_count;
    T* m_data = nullptr;
};

constexpr std::size_t kMoreThanCache = std::size_t{256} << 20;

/// Queries of a motion's frames, one after another.
class ConvexClock
{
public:
    ConvexClock(const ConvexMotion& motion, const ConvexQuery& query)
        : m_motion(motion),
          m_query(query),
          m_poses(motion.frame(0).size()),
          m_pairs(motion.pairs().size()),
          m_flush(kMoreThanCache),
          m_timer(m_stream.get())
    {
        m_pairs.upload(motion.pairs());
        std::string why;
        m_queries = makeDeviceConvexPairs(motion.hulls(), 0, m_stream.get(), &why);
        if (!m_queries)
            throw std::runtime_error(why);
    }

    /// Milliseconds of the query of a frame.
    double time(int frame)
    {
        m_poses.upload(m_motion.frame(frame));
        checkCuda(cudaMemsetAsync(m_flush.data(), frame, m_flush.bytes(), m_stream.get()));
        checkCuda(cudaStreamSynchronize(m_stream.get()));
        m_timer.begin();
        requireOk(m_queries->enqueue({m_poses.data(), static_cast<std::uint32_t>(m_motion.frame(0).size())},
                                     m_pairs.data(), m_motion.pairs().size(), m_query));
        m_timer.end();
        DevicePairAnswers answers;
        requireOk(m_queries->collect(answers, m_counts));
        if (m_counts.overlapping != m_motion.overlapping())
            throw std::runtime_error(std::to_string(m_counts.overlapping) + " pairs overlap instead of " +
                                     std::to_string(m_motion.overlapping()));
        checkContacts(answers);
        return m_timer.milliseconds();
    }

    void forget() { m_queries->forget(); }
    const ConvexPairCounts& counts() const { return m_counts; }
    std::uint64_t bytes() const { return m_queries->bytes(); }

private:
    void checkContacts(const DevicePairAnswers& answers)
    {
        m_depths.resize(answers.depths != nullptr ? m_counts.overlapping : 0);
        m_contacts.resize(answers.contacts != nullptr ? m_counts.overlapping : 0);
        requireOk(m_queries->copyContacts(nullptr, m_depths.empty() ? nullptr : m_depths.data(),
                                          m_contacts.empty() ? nullptr : m_contacts.data(), m_depths.size()));
        const auto isFilled = [](const PairContact& contact)
        { return contact.count >= 1 && contact.count <= 4; };
        if (!std::all_of(m_depths.begin(), m_depths.end(), isProved) ||
            !std::all_of(m_contacts.begin(), m_contacts.end(), isFilled))
            throw std::runtime_error("a depth is not proved, or a contact is empty");
    }

    const ConvexMotion& m_motion;
    ConvexQuery m_query;
    Stream m_stream;
    DeviceList<BodyPose> m_poses;
    DeviceList<RowPair> m_pairs;
    DeviceList<char> m_flush;
    StreamTimer m_timer;
    std::unique_ptr<DeviceConvexPairs> m_queries;
    ConvexPairCounts m_counts;
    std::vector<PairDepth> m_depths;
    std::vector<PairContact> m_contacts;
};

/// The value below which that share of the values lies.
double quantile(std::vector<double> values, double share)
{
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}
}  // namespace

ConvexTimes timeConvexPairs(const ConvexMotion& motion, int frames, const ConvexQuery& query)
{
    ConvexClock clock(motion, query);
    // To the last frame and back: neighbours in the sequence are neighbours in time.
    const int last = motion.frameCount() - 1;
    const auto frameOf = [last](int step)
    { return step % (2 * last) <= last ? step % (2 * last) : 2 * last - step % (2 * last); };
    std::vector<double> warm, cold;
    for (int step = 0; step < kWarmUps + frames; ++step)
    {
        const double passed = clock.time(frameOf(step));
        if (step >= kWarmUps)
            warm.push_back(passed);
    }
    ConvexTimes times;
    times.counts = clock.counts();
    for (int step = 0; step < frames; ++step)
    {
        clock.forget();
        cold.push_back(clock.time(frameOf(step)));
    }
    times.warmMs = quantile(warm, 0.5);
    times.warmP90Ms = quantile(warm, 0.9);
    times.coldMs = quantile(cold, 0.5);
    times.bytes = clock.bytes();
    return times;
}
}  // namespace cullet
