// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/scene_statistics.h"

#include <algorithm>
#include <cstdint>
#include <utility>

/// The input and the statistics of every search.
namespace cullet::psap
{
/// Boxes to search, by row, in the executor's memory.
struct SearchInput
{
    const Aabb* boxes;
    std::uint64_t count;
    std::uint64_t* pairCount = nullptr;  ///< build() sets it to 0
    std::uint64_t expectedPairs = 0;     ///< pairs of the previous update; chooses the fastest search
    BoxCopies copies{};                  ///< copies that build() makes
};

/// Copies box i.
struct CopyBox
{
    const Aabb* boxes;
    BoxCopies copies;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { copies.keep(i, loadBox(boxes, i)); }
};

template <class Exec>
void clearPairCount(Exec& exec, const SearchInput& input)
{
    if (input.pairCount != nullptr)
        exec.clear(input.pairCount, 1);
}

/// Size of the sample of every `stride`-th box.
inline std::uint64_t samplesOf(const SearchInput& input, std::uint64_t stride)
{
    return (input.count + stride - 1) / stride;
}

/// Copies box i of such a sample: the boxes may change before they are needed.
struct KeepSample
{
    const Aabb* boxes;
    std::uint64_t stride;
    Aabb* kept;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        storeBox(kept, i, loadBox(boxes, i * stride));
    }
};

/// Allocates the plan in use and the next one, which is later copied over it as a whole.
template <class Exec, class Buffer>
void reservePlans(Exec& exec, Buffer (&plans)[2])
{
    for (Buffer& plan : plans)
    {
        exec.reserve(plan, 1);
        exec.clear(plan.data(), 1);
    }
}

/// Sums over the boxes, for the choice of axis and cells.
template <class Exec>
class Statistics
{
public:
    /// Sums over every `stride`-th box.
    void collect(Exec& exec, const SearchInput& input, std::uint64_t stride)
    {
        sum(exec, input, stride, nullptr);
    }

    /// Sums over the boxes inside a window, which leaves out boxes far away from most others.
    void collectWithinWindow(Exec& exec, const SearchInput& input)
    {
        const bool isFirst = reserveFor(exec, input);
        // Each pass excludes only the farthest boxes, since one far away hides others less far.
        for (int pass = isFirst ? 0 : kPasses - 1; pass < kPasses; ++pass)
        {
            if (isFirst)
                exec.forEach(1, FindWindow{pass == 0 ? nullptr : moments(), m_window.data()});
            sum(exec, input, 1, m_window.data());
        }
    }

    /// collectWithinWindow() in steps: prepareNext(), begin(), and reduceStep() until it returns true.
    void prepareNext(Exec& exec)
    {
        exec.forEach(1, FindWindow{moments(), m_window.data()});
        exec.clear(m_sizes.data(), 1);
    }
    /// @pre reserveFor() with the same input
    void begin(Exec& exec, const SearchInput& input)
    {
        m_parts = partsOf(input, 1);
        sumParts(exec, input, 1, m_parts, m_window.data());
    }
    bool reduceStep(Exec& exec)
    {
        if (m_parts > 1)
            m_parts = reduceOnce(exec, m_parts);
        return m_parts == 1;
    }

    /// @return whether there is no valid window
    bool reserveFor(Exec& exec, const SearchInput& input)
    {
        const std::uint64_t parts = partsOf(input, 1);
        const bool isFirst = m_window.size() == 0 || parts > m_moments[0].size();
        exec.reserve(m_window, 1);
        reserveParts(exec, parts);
        return isFirst;
    }

    const Moments* moments() const { return m_moments[0].data(); }
    const SizeClasses* sizes() const { return m_sizes.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr int kPasses = 4;

    /// Enough parts to keep a GPU busy, the same for every executor: the sums depend on the number.
    static std::uint64_t partsOf(const SearchInput& input, std::uint64_t stride)
    {
        return std::clamp<std::uint64_t>(samplesOf(input, stride) / 4, 1, 16384);
    }

    void reserveParts(Exec& exec, std::uint64_t parts)
    {
        exec.reserve(m_moments[0], parts);
        exec.reserve(m_moments[1], parts);
        exec.reserve(m_sizes, 1);
    }

    void sum(Exec& exec, const SearchInput& input, std::uint64_t stride, const CentreWindow* window)
    {
        std::uint64_t parts = partsOf(input, stride);
        reserveParts(exec, parts);
        exec.clear(m_sizes.data(), 1);
        sumParts(exec, input, stride, parts, window);
        while (parts > 1)
            parts = reduceOnce(exec, parts);
    }

    void sumParts(Exec& exec, const SearchInput& input, std::uint64_t stride, std::uint64_t parts,
                  const CentreWindow* window)
    {
        exec.forEach(parts, SumBoxes{input.boxes, input.count, parts, stride, window, m_moments[0].data(),
                                     m_sizes.data()});
    }

    /// @return number of sums that remain
    std::uint64_t reduceOnce(Exec& exec, std::uint64_t parts)
    {
        const std::uint64_t sums = (parts + SumMoments::kFanIn - 1) / SumMoments::kFanIn;
        exec.forEach(sums, SumMoments{m_moments[0].data(), parts, m_moments[1].data()});
        std::swap(m_moments[0], m_moments[1]);
        return sums;
    }

    std::uint64_t m_parts = 0;  ///< partial sums that remain
    Buffer<CentreWindow> m_window;
    Buffer<Moments> m_moments[2];
    Buffer<SizeClasses> m_sizes;
};
}  // namespace cullet::psap
