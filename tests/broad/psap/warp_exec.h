// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/cuda/host/host_exec.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace cullet::test
{
/// A reusable barrier.
class Meeting
{
public:
    explicit Meeting(std::uint32_t size) : m_size(size) {}

    void wait()
    {
        std::unique_lock<std::mutex> lock(m_mutex);
        const std::uint64_t round = m_round;
        if (++m_here == m_size)
        {
            m_here = 0;
            ++m_round;
            m_all.notify_all();
            return;
        }
        m_all.wait(lock, [&] { return m_round != round; });
    }

private:
    const std::uint32_t m_size;
    std::mutex m_mutex;
    std::condition_variable m_all;
    std::uint32_t m_here = 0;
    std::uint64_t m_round = 0;
};

/// HostExec with groups like a GPU's: 32 lanes, each a thread, so that the thread sanitizer reports missing
/// synchronisation of shared memory. Unlike on a GPU, lanes that vote wait for each other.
class WarpExec : public psap::HostExec
{
public:
    static constexpr std::uint32_t kLanes = 32;

    using HostExec::HostExec;

    template <class Step>
    void forEachWarp(std::uint64_t count, const Step& step, const psap::PairList& list)
    {
        Warp<typename Step::Scratch> warp{list};
        const std::uint64_t end = (count + kLanes - 1) / kLanes * kLanes;
        std::vector<std::thread> lanes;
        for (std::uint32_t lane = 0; lane < kLanes; ++lane)
            lanes.emplace_back(
                [&, lane]
                {
                    Lane<typename Step::Scratch> emit(warp, lane);
                    for (std::uint64_t i = lane; i < end; i += kLanes)
                    {
                        step(i, i < count, emit);
                        emit.sync();
                    }
                });
        for (std::thread& lane : lanes)
            lane.join();
        largestSum = warp.largestSum;
        mostAtOnce = warp.mostAtOnce;
        tests += warp.tests;
    }

    /// The largest total that the lanes of the last step requested.
    std::uint32_t largestSum = 0;
    std::uint32_t mostAtOnce = 0;  ///< pairs appended by a group at once
    std::uint64_t tests = 0;       ///< box tests of all steps

private:
    template <class Scratch>
    struct Warp
    {
        psap::PairList list;
        Meeting meeting{kLanes};
        std::uint64_t said[kLanes] = {};
        Scratch scratch = {};
        std::uint32_t largestSum = 0, mostAtOnce = 0;  ///< written by the first lane
        std::atomic<std::uint64_t> tests{0};
    };

    /// The group as seen by a step.
    template <class Scratch>
    class Lane
    {
    public:
        static constexpr std::uint32_t kLanes = WarpExec::kLanes;

        Lane(Warp<Scratch>& warp, std::uint32_t lane) : m_warp(warp), m_lane(lane) {}

        void push(RowPair pair) { m_warp.list.push(pair); }
        void tested(std::uint64_t count) { m_warp.tests += count; }
        bool any(bool isMine) { return ballot(isMine) != 0; }

        Scratch& scratch() { return m_warp.scratch; }
        std::uint32_t lane() const { return m_lane; }
        void sync() { m_warp.meeting.wait(); }
        std::uint32_t ballot(bool isMine)
        {
            return hear(std::uint32_t{isMine},
                        [](const std::uint64_t* said)
                        {
                            std::uint32_t lanes = 0;
                            for (std::uint32_t k = 0; k < kLanes; ++k)
                                lanes |= static_cast<std::uint32_t>(said[k]) << k;
                            return lanes;
                        });
        }
        std::uint32_t countOf(std::uint32_t lanes) const
        {
            return static_cast<std::uint32_t>(__builtin_popcount(lanes));
        }
        std::uint32_t rankIn(std::uint32_t lanes) const { return countOf(lanes & ((1u << m_lane) - 1u)); }
        std::uint32_t from(std::uint32_t value, std::uint32_t lane)
        {
            return hear(value,
                        [lane](const std::uint64_t* said) { return static_cast<std::uint32_t>(said[lane]); });
        }
        std::uint32_t sum(std::uint32_t value)
        {
            const std::uint32_t all = sumOf(value);
            if (m_lane == 0)
                m_warp.largestSum = std::max(m_warp.largestSum, all);
            return all;
        }
        float least(float value)
        {
            return hear(bitsOf(value),
                        [](const std::uint64_t* said)
                        {
                            float smallest = psap::kInfinity;
                            for (std::uint32_t k = 0; k < kLanes; ++k)
                                smallest =
                                    std::min(smallest, psap::floatOf(static_cast<std::uint32_t>(said[k])));
                            return smallest;
                        });
        }
        template <class PairAt>
        void appendEach(std::uint32_t bits, const PairAt& pairAt)
        {
            const std::uint32_t all = sumOf(countOf(bits));
            if (m_lane == 0)
                m_warp.mostAtOnce = std::max(m_warp.mostAtOnce, all);
            for (; bits != 0; bits &= bits - 1)
                push(pairAt(lowestBit(bits)));
        }

    private:
        /// The result of `body` on the values of all lanes.
        template <class Body>
        auto hear(std::uint64_t own, const Body& body)
        {
            m_warp.said[m_lane] = own;
            m_warp.meeting.wait();
            const auto heard = body(m_warp.said);
            m_warp.meeting.wait();
            return heard;
        }
        std::uint32_t sumOf(std::uint32_t value)
        {
            return hear(value,
                        [](const std::uint64_t* said)
                        {
                            std::uint64_t all = 0;
                            for (std::uint32_t k = 0; k < kLanes; ++k)
                                all += said[k];
                            return static_cast<std::uint32_t>(all);
                        });
        }

        Warp<Scratch>& m_warp;
        std::uint32_t m_lane;
    };
};
}  // namespace cullet::test
