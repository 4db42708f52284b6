// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/convex_times.h"

#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/bench/narrow/quantile.h"
#include "cullet/demos/program/stopwatch.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
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

/// Memory of the CPU that a device reads and writes by itself.
template <class T>
class PinnedList
{
public:
    explicit PinnedList(std::size_t count) : m_count(count)
    {
        checkCuda(cudaMallocHost(reinterpret_cast<void**>(&m_data), count * sizeof(T)));
    }
    PinnedList(const PinnedList&) = delete;
    PinnedList& operator=(const PinnedList&) = delete;
    ~PinnedList() { cudaFreeHost(m_data); }

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
          m_flush(kMoreThanCache)
    {
        m_poses.upload(motion.frame(0));
        m_pairs.upload(motion.pairs());
        std::string why;
        m_queries = makeDeviceConvexPairs(motion.hulls(), 0, m_stream.get(), &why);
        if (!m_queries)
            throw std::runtime_error(why);
    }
    ConvexClock(const ConvexClock&) = delete;
    ConvexClock& operator=(const ConvexClock&) = delete;
    virtual ~ConvexClock() = default;

    /// Milliseconds of the query of a frame.
    virtual double time(int frame) = 0;

    void forget() { m_queries->forget(); }
    const ConvexPairCounts& counts() const { return m_counts; }
    std::uint64_t bytes() const { return m_queries->bytes(); }

protected:
    const ConvexMotion& motion() const { return m_motion; }
    DeviceConvexPairs& queries() const { return *m_queries; }
    DeviceList<BodyPose>& poses() { return m_poses; }
    cudaStream_t stream() const { return m_stream.get(); }

    void flushCache(int frame)
    {
        checkCuda(cudaMemsetAsync(m_flush.data(), frame, m_flush.bytes(), stream()));
        checkCuda(cudaStreamSynchronize(stream()));
    }
    void enqueue()
    {
        requireOk(m_queries->enqueue({m_poses.data(), static_cast<std::uint32_t>(m_motion.frame(0).size())},
                                     m_pairs.data(), m_motion.pairs().size(), m_query));
    }
    DevicePairAnswers collect()
    {
        DevicePairAnswers answers;
        requireOk(m_queries->collect(answers, m_counts));
        m_motion.requireOverlapping(m_counts.overlapping);
        return answers;
    }

private:
    const ConvexMotion& m_motion;
    ConvexQuery m_query;
    Stream m_stream;
    DeviceList<BodyPose> m_poses;
    DeviceList<RowPair> m_pairs;
    DeviceList<char> m_flush;
    std::unique_ptr<DeviceConvexPairs> m_queries;
    ConvexPairCounts m_counts;
};

/// By the device's clock.
class QueryClock final : public ConvexClock
{
public:
    QueryClock(const ConvexMotion& motion, const ConvexQuery& query)
        : ConvexClock(motion, query), m_timer(stream())
    {
    }

    double time(int frame) override
    {
        poses().upload(motion().frame(frame));
        flushCache(frame);
        m_timer.begin();
        enqueue();
        m_timer.end();
        checkContacts(collect());
        return m_timer.milliseconds();
    }

private:
    void checkContacts(const DevicePairAnswers& answers)
    {
        m_depths.resize(answers.depths != nullptr ? counts().overlapping : 0);
        m_contacts.resize(answers.contacts != nullptr ? counts().overlapping : 0);
        requireOk(queries().copyContacts(nullptr, m_depths.empty() ? nullptr : m_depths.data(),
                                         m_contacts.empty() ? nullptr : m_contacts.data(), m_depths.size()));
        const auto isFilled = [](const PairContact& contact)
        { return contact.count >= 1 && contact.count <= 4; };
        if (!std::all_of(m_depths.begin(), m_depths.end(), isProved) ||
            !std::all_of(m_contacts.begin(), m_contacts.end(), isFilled))
            throw std::runtime_error("a depth is not proved, or a contact is empty");
    }

    StreamTimer m_timer;
    std::vector<PairDepth> m_depths;
    std::vector<PairContact> m_contacts;
};

ConvexQuery withList()
{
    ConvexQuery query;
    query.listOverlaps = true;
    return query;
}

/// By the CPU's clock, with both copies.
class RoundTripClock final : public ConvexClock
{
public:
    explicit RoundTripClock(const ConvexMotion& motion)
        : ConvexClock(motion, withList()),
          m_moving(motion.frame(0).size() - motion.firstMoving()),
          m_places(motion.pairs().size())
    {
    }

    double time(int frame) override
    {
        const std::vector<BodyPose>& all = motion().frame(frame);
        const std::size_t first = motion().firstMoving();
        std::copy(all.begin() + static_cast<std::ptrdiff_t>(first), all.end(), m_moving.data());
        flushCache(frame);
        const Stopwatch watch;
        checkCuda(cudaMemcpyAsync(poses().data() + first, m_moving.data(), m_moving.bytes(),
                                  cudaMemcpyHostToDevice, stream()));
        enqueue();
        collect();
        requireOk(queries().copyContacts(m_places.data(), nullptr, nullptr, counts().overlapping));
        const double passed = watch.wallMs();
        checkPlaces();
        return passed;
    }

private:
    void checkPlaces() const
    {
        const auto isDeep = [&](std::uint32_t pair) { return motion().isPlantedDeep(pair); };
        const std::uint32_t *const begin = m_places.data(), *const end = begin + counts().overlapping;
        // As many as are planted are then all of them.
        if (!std::all_of(begin, end, isDeep) || std::adjacent_find(begin, end, std::greater_equal<>()) != end)
            throw std::runtime_error("a pair overlaps that is planted apart, or is listed twice");
    }

    PinnedList<BodyPose> m_moving;
    PinnedList<std::uint32_t> m_places;
};

ConvexTimes timesOf(ConvexClock& clock, const ConvexMotion& motion, int frames)
{
    std::vector<double> warm, cold;
    for (int step = 0; step < kWarmUps + frames; ++step)
    {
        const double passed = clock.time(motion.frameAt(step));
        if (step >= kWarmUps)
            warm.push_back(passed);
    }
    ConvexTimes times;
    times.counts = clock.counts();
    for (int step = 0; step < frames; ++step)
    {
        clock.forget();
        cold.push_back(clock.time(motion.frameAt(step)));
    }
    times.warmMs = quantile(warm, 0.5);
    times.warmP90Ms = quantile(warm, 0.9);
    times.coldMs = quantile(cold, 0.5);
    times.bytes = clock.bytes();
    return times;
}
}  // namespace

ConvexTimes timeConvexPairs(const ConvexMotion& motion, int frames, const ConvexQuery& query)
{
    QueryClock clock(motion, query);
    return timesOf(clock, motion, frames);
}

ConvexTimes timeRoundTrips(const ConvexMotion& motion, int frames)
{
    RoundTripClock clock(motion);
    return timesOf(clock, motion, frames);
}
}  // namespace cullet
