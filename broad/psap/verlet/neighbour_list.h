// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/bins.h"
#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/broad/psap/verlet/neighbour_steps.h"
#include "cullet/broad/psap/verlet/skin_policy.h"

#include <algorithm>
#include <cstdint>
#include <new>
#include <utility>

namespace cullet::psap
{
/// Counters of a neighbour list, in an executor's memory. They persist from one set of boxes to the next.
struct NeighbourCounts
{
    std::uint64_t pairs;                      ///< may exceed the number that was written
    alignas(128) std::uint32_t displacement;  ///< as MeasureDisplacement::displacement, in its own cache line
};

/// A neighbour list in an executor's memory, and the policy that decides when it is made.
template <class Exec>
class NeighbourStore
{
public:
    explicit NeighbourStore(const PsapOptions& options)
        : m_policy(options.nearPairs), m_initial(std::max<std::uint64_t>(options.initialCapacity, 1))
    {
    }

    /// Mode for the next set of boxes. The executor must have completed the last one.
    NeighbourMode choose(std::uint64_t boxes)
    {
        beginSet(boxes);
        return m_policy.choose(boxes);
    }
    /// Chooses whether the list is followed for the next set of boxes, where lists are made between two sets.
    bool chooseFollow(std::uint64_t boxes, float thinnest)
    {
        beginSet(boxes);
        return m_policy.chooseFollow(boxes, thinnest);
    }
    SkinPolicy& policy() { return m_policy; }
    const SkinPolicy& policy() const { return m_policy; }

    /// Reserves memory for a new list.
    ///
    /// @return false where there is not enough memory; no list is made any more
    bool reserve(Exec& exec, std::uint64_t boxes)
    {
        m_boxCount = boxes;
        return unlessShort(exec,
                           [&]
                           {
                               exec.reserve(m_reference, std::max<std::uint64_t>(boxes, 1));
                               exec.reserve(m_grown, std::max<std::uint64_t>(boxes, 1));
                               const std::uint64_t expected =
                                   std::max(m_lastCount + m_lastCount / 64, m_initial);
                               if (m_span < expected || m_span / 2 > expected)
                                   setSpan(expected);
                               reserveList(exec);
                           });
    }

    /// Gives all boxes their skins, and stores copies. The search for the list uses grown().
    void grow(Exec& exec, const Aabb* boxes, const BoxCopies& copies)
    {
        const StridedBoxes shared = {m_boxCount};
        exec.forEach(shared.indices(), GrowSkins{shared, boxes, copies, m_policy.rule(), skinned()});
    }
    /// Gives the boxes of rows their skins.
    void growRows(Exec& exec, const RowBoxes& rows)
    {
        exec.forEach(m_boxCount, GrowRow{rows, m_policy.rule(), skinned()});
    }
    const Aabb* grown() const { return m_grown.data(); }
    const AlignedBox* reference() const { return m_reference.data(); }

    /// Makes the search write the neighbouring pairs to the list.
    template <class Search>
    void find(Exec& exec, Search& search, NeighbourCounts* counts)
    {
        search.emit(exec, EveryPair{}, list(counts).found());
    }
    /// Repeats find() with enough room.
    ///
    /// @param found number of pairs of the first attempt, or kOverflowed
    /// @return as reserve()
    template <class Search>
    bool findAgain(Exec& exec, Search& search, NeighbourCounts* counts, std::uint64_t found)
    {
        if (found == kOverflowed)
            search.buildByCounting(exec, grown());
        else if (!growTo(exec, found + found / 64))
            return false;
        exec.clear(&counts->pairs, 1);
        find(exec, search, counts);
        return true;
    }
    std::uint64_t room() const { return m_span; }
    /// Changes when the launches change.
    std::uint32_t launches() const { return m_launches + m_policy.revision(); }
    void recordBegun(std::uint64_t found, std::uint64_t pairs)
    {
        m_lastCount = found;
        m_policy.recordBegun(found, m_boxCount, pairs);
    }
    /// Discards the list. The next one gets room for so many pairs, where the number is known.
    void recordOverflow(std::uint64_t found)
    {
        m_lastCount = found < kVoidCount ? found : m_lastCount;
        m_policy.forget();
    }

    NeighbourView list(NeighbourCounts* counts) const
    {
        return {m_pairs.data(), m_closeness.data(), m_span, &counts->pairs};
    }
    /// [room()] flags of the pairs that are held, for one of two sets of boxes.
    std::uint8_t* isHeld(unsigned side) const { return m_isHeld[side].data(); }

    /// Records the skins of a search. Returns whether they are thicker than those of the last search, so that its
    /// plan does not fit.
    bool recordSearchedSkin(NeighbourMode mode)
    {
        const float skin = mode == NeighbourMode::Begin ? m_policy.rule().common : 0.0f;
        return std::exchange(m_skinSearched, skin) < skin;
    }

    /// Samples the sizes of boxes, where it is time to.
    ///
    /// @param copies as SampleBoxes::copies
    template <class Copies>
    void sample(Exec& exec, const Copies& copies, std::uint64_t count)
    {
        if (!m_policy.wantsSample(count))
            return;
        const std::uint64_t stride = (count + kSample - 1) / kSample;
        m_sampleCount = (count + stride - 1) / stride;
        exec.reserve(m_sample, kSample);
        exec.reserve(m_sampled, kSample);
        exec.forEach(m_sampleCount, SampleBoxes<Copies>{copies, stride, count, m_sample.data()});
        exec.download(m_sampled.data(), m_sample.data(), m_sampleCount);
        m_isSampled = true;
        m_policy.recordSampling();
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr std::uint64_t kSample = 1024;

    void beginSet(std::uint64_t boxes)
    {
        if (m_isSampled)
            m_policy.recordSample(m_sampled.data(), m_sampleCount);
        m_isSampled = false;
        if (boxes != m_boxCount)
            m_policy.forget();
    }

    SkinnedBoxes skinned() const { return {m_reference.data(), m_grown.data()}; }

    bool growTo(Exec& exec, std::uint64_t pairs)
    {
        return unlessShort(exec,
                           [&]
                           {
                               setSpan(pairs);
                               reserveList(exec);
                           });
    }

    /// Calls body(). Gives up the list where memory is short, since the searches need it more.
    template <class Body>
    bool unlessShort(Exec& exec, const Body& body)
    {
        try
        {
            body();
            return true;
        }
        catch (const ExecutorFailure& failure)
        {
            if (failure.status != Status::OutOfMemory)
                throw;
        }
        catch (const std::bad_alloc&)
        {
        }
        giveUp(exec);
        return false;
    }

    void giveUp(Exec& exec)
    {
        m_policy = SkinPolicy(PsapNearPairs::Never);
        exec.release(m_reference);
        exec.release(m_grown);
        exec.release(m_pairs);
        exec.release(m_closeness);
        for (Buffer<std::uint8_t>& isHeld : m_isHeld)
            exec.release(isHeld);
    }

    /// Sets the room of the list to slightly more than so many pairs, so that it seldom changes.
    void setSpan(std::uint64_t pairs)
    {
        m_span = std::max(pairs + pairs / 32, m_initial);
        ++m_launches;
    }

    void reserveList(Exec& exec)
    {
        exec.reserve(m_pairs, m_span);
        exec.reserve(m_closeness, m_pairs.size());
        for (Buffer<std::uint8_t>& isHeld : m_isHeld)
            exec.reserve(isHeld, m_pairs.size());
    }

    SkinPolicy m_policy;
    std::uint64_t m_initial;
    std::uint64_t m_boxCount = 0;   ///< boxes in the list
    std::uint64_t m_lastCount = 0;  ///< pairs in the last list
    std::uint32_t m_launches = 0;
    float m_skinSearched = 0;
    std::uint64_t m_span = 0;        ///< room for pairs, a parameter of the launches
    Buffer<AlignedBox> m_reference;  ///< boxes when the list was made, and their skins
    Buffer<Aabb> m_grown;            ///< those boxes enlarged by their skins
    Buffer<RowPair> m_pairs;
    Buffer<float> m_closeness;
    Buffer<std::uint8_t> m_isHeld[2];
    bool m_isSampled = false;
    std::uint64_t m_sampleCount = 0;
    Buffer<BoxInSample> m_sample;
    typename Exec::template Staging<BoxInSample> m_sampled;
};
}  // namespace cullet::psap
