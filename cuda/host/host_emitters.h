// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"

#include <atomic>
#include <cstdint>

/// The emitters of the CPU, through which steps append to their lists.
namespace cullet::psap
{
/// Appends the pairs of a step to its list.
struct HostEmitter
{
    PairList list;
    std::atomic<std::uint64_t>* tests;
    std::uint64_t ownTests;

    HostEmitter(const PairList& pairs, std::atomic<std::uint64_t>* total, std::uint64_t count)
        : list(pairs), tests(total), ownTests(count)
    {
    }
    HostEmitter(const HostEmitter& other) : HostEmitter(other.list, other.tests, 0) {}
    ~HostEmitter() { tests->fetch_add(ownTests, std::memory_order_relaxed); }

    void push(RowPair pair) { list.push(pair); }
    void tested(std::uint64_t count) { ownTests += count; }
    bool any(bool isMine) const { return isMine; }
    void append(bool isMine, RowPair pair)
    {
        if (isMine)
            push(pair);
    }

    bool isFull() const { return m_keptCount == kMostKept; }
    bool hasRoomForTwo() const { return m_keptCount + 2 <= kMostKept; }
    void keep(std::uint32_t record) { m_kept[m_keptCount++] = record; }
    std::uint32_t keptCount() const { return m_keptCount; }
    std::uint32_t kept(std::uint32_t k) const { return m_kept[k]; }
    void dropKept() { m_keptCount = 0; }
    void appendKept(std::uint32_t row)
    {
        for (std::uint32_t k = 0; k < m_keptCount; ++k)
            push({row, m_kept[k]});
        dropKept();
    }

private:
    // Few, so that tests fill it.
    static constexpr std::uint32_t kMostKept = 2;

    std::uint32_t m_keptCount = 0;
    std::uint32_t m_kept[kMostKept] = {};
};

/// Appends pairs with depths to a list.
struct HostDepthEmitter
{
    DepthList list;

    void append(bool isMine, RowPair pair, float depth)
    {
        if (isMine)
            list.push(pair, depth);
    }
};

/// A warp of one lane.
template <class Scratch>
struct HostWarpEmitter : HostEmitter
{
    static constexpr std::uint32_t kLanes = 1;

    explicit HostWarpEmitter(const HostEmitter& emitter) : HostEmitter(emitter) {}

    Scratch& scratch() { return m_scratch; }
    std::uint32_t lane() const { return 0; }
    void sync() const {}
    std::uint32_t ballot(bool isMine) const { return isMine ? 1 : 0; }
    std::uint32_t countOf(std::uint32_t lanes) const { return lanes; }
    std::uint32_t rankIn(std::uint32_t) const { return 0; }
    std::uint32_t from(std::uint32_t value, std::uint32_t) const { return value; }
    std::uint32_t sum(std::uint32_t value) const { return value; }
    float least(float value) const { return value; }
    template <class PairAt>
    void appendEach(std::uint32_t bits, const PairAt& pairAt)
    {
        for (; bits != 0; bits &= bits - 1)
            this->push(pairAt(lowestBit(bits)));
    }

private:
    Scratch m_scratch = {};
};
}  // namespace cullet::psap
