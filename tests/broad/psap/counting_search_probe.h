// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/search.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_lists.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <new>
#include <vector>

namespace cullet::test
{
/// HostExec with extra lanes that records the searches, and may run out of memory.
class WatchedExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    template <class T>
    void reserve(psap::HostBuffer<T>& buffer, std::uint64_t count)
    {
        if (reservesLeft-- == 0)
            throw std::bad_alloc();
        HostExec::reserve(buffer, count);
    }

    bool hasSpareLanes() const { return true; }

    template <std::uint32_t kSharers, class Step>
    void forEachBinSlot(std::uint64_t bins, const Step& step, const psap::PairList& list)
    {
        ++searchesOfBins;
        HostExec::forEachBinSlot<kSharers>(bins, step, list);
    }

    template <class Step>
    void searchTiles(const Step& step, const psap::PairList& list)
    {
        ++searchesOfTiles;
        lastShape = step.shape;
        HostExec::searchTiles(step, list);
    }

    bool canSearchTiles(const psap::TileShape& shape) const { return shape.tiles <= mostTiles; }

    int reservesLeft = -1;  ///< before one that fails
    int searchesOfBins = 0;
    int searchesOfTiles = 0;
    psap::TileShape lastShape{};
    std::uint32_t mostTiles = psap::TileShape::kMostTiles;
};

/// A search for all pairs that can be repeated.
class WatchedSearch
{
public:
    explicit WatchedSearch(const PsapOptions& options = {}) : exec(options), m_search(options) {}
    explicit WatchedSearch(PsapOrder order, PsapExecutor executor = PsapExecutor::InOrder)
        : WatchedSearch(optionsOf(order, executor))
    {
    }

    /// @return all pairs in order, by the counting-sort search if a bin or a tile was full
    Pairs find(const std::vector<Aabb>& boxes, std::uint64_t expectedPairs = 0)
    {
        m_search.poll(exec);
        m_search.build(exec, {boxes.data(), boxes.size(), &m_count, expectedPairs});
        emit();
        m_search.advanceNextPlan(exec);
        m_wasFull = m_count == psap::kOverflowed;
        if (m_wasFull)
        {
            m_search.buildByCounting(exec, boxes.data());
            emit();
        }
        EXPECT_LE(m_count, m_found.size());
        return inOrder({m_found.begin(), m_found.begin() + static_cast<std::ptrdiff_t>(m_count)});
    }

    /// Whether find() with these arguments would repeat the launches of the last one.
    bool isRepeatable(const std::vector<Aabb>& boxes, std::uint64_t expectedPairs)
    {
        m_search.poll(exec);
        return m_search.isRepeatable(exec, {boxes.data(), boxes.size(), &m_count, expectedPairs});
    }
    std::uint32_t launches() const { return m_search.launches(); }
    unsigned nextPhase() const { return m_search.nextPhase(); }
    /// Counts a find() whose recorded launches would be repeated.
    void countRepeat() { m_search.countRepeat(); }

    /// Repeats the last find(), as for a list that was too short.
    Pairs findAgain()
    {
        m_count = 0;
        emit();
        return inOrder({m_found.begin(), m_found.begin() + static_cast<std::ptrdiff_t>(m_count)});
    }

    bool wasFull() const { return m_wasFull; }
    int searchesOfBins() const { return exec.searchesOfBins; }
    int searchesOfTiles() const { return exec.searchesOfTiles; }

    WatchedExec exec;

private:
    static PsapOptions optionsOf(PsapOrder order, PsapExecutor executor)
    {
        PsapOptions options;
        options.order = order;
        options.executor = executor;
        options.threads = 3;
        return options;
    }

    void emit() { m_search.emit(exec, psap::EveryPair{}, {m_found.data(), m_found.size(), &m_count}); }

    psap::Search<WatchedExec> m_search;
    std::vector<RowPair> m_found = std::vector<RowPair>(1u << 20);
    std::uint64_t m_count = 0;
    bool m_wasFull = false;
};

/// Unit cubes in a block of space with these sides, relative to each other; one per `volume`.
inline std::vector<Aabb> cubesIn(std::uint32_t count, float volume, Random& random, float x = 1, float y = 1,
                                 float z = 1)
{
    const float side = std::cbrt(volume * static_cast<float>(count) / (x * y * z));
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        // From z to x, as Random::point().
        const float atZ = random.between(0, z * side), atY = random.between(0, y * side);
        boxes.push_back(boxAt(random.between(0, x * side), atY, atZ));
    }
    return boxes;
}

/// Changes some of 1,000 boxes to kinds that a plan for unit cubes does not cover: larger, far, unbounded and invalid
/// ones.
inline void makeSomeUnplanned(std::vector<Aabb>& boxes, Random& random)
{
    for (std::uint32_t i = 0; i < 10; ++i)
        boxes[100 * i] = boxAt(random.point(0, 16), 1.5f);
    for (std::uint32_t i = 0; i < 3; ++i)
        boxes[100 * i + 1] = boxAt(random.between(-1e6f, 1e6f), 0, 0, 40);
    boxes[7] = boxes[8] = boxAt(1e7f, 0, 0);
    boxes[9] = {{-kInfinity, -kInfinity, -1}, {kInfinity, kInfinity, 1}};
    boxes[10] = {{kNan, 0, 0}, {1, 1, 1}};
}

inline Pairs pairsByCounting(const std::vector<Aabb>& boxes)
{
    return WatchedSearch(PsapOrder::Counting).find(boxes);
}
}  // namespace cullet::test
