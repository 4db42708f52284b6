// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_statistics.h"

#include <algorithm>
#include <cstdint>
#include <utility>

/// What every search begins with.
namespace cullet::psap
{
/// Boxes to search, by row, in the executor's memory.
struct SearchInput
{
    const Aabb* boxes;
    std::uint64_t count;
    std::uint64_t* pairCount = nullptr;  ///< build() sets it to 0
    std::uint64_t expectedPairs = 0;     ///< about as many as before; decides what is fastest
    BoxCopies copies{};                  ///< build() makes them
};

/// Keeps a copy of box i.
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

/// Sums the boxes for the choice of axis and cells.
template <class Exec>
class Statistics
{
public:
    /// All boxes.
    void collect(Exec& exec, const SearchInput& input, std::uint64_t stride)
    {
        sum(exec, input, stride, partsOf(input, stride), nullptr);
    }

    /// But for those that are far away from most, or were not among them the last time.
    void collectMost(Exec& exec, const SearchInput& input, std::uint64_t stride)
    {
        const std::uint64_t parts = partsOf(input, stride);
        const bool isFirst = m_window.size() == 0 || parts > m_moments[0].size();
        exec.reserve(m_window, 1);
        // One far away hides others that are not as far.
        for (int pass = isFirst ? 0 : kPasses - 1; pass < kPasses; ++pass)
        {
            const bool isKnown = !isFirst || pass > 0;
            exec.forEach(1, FindWindow{isKnown ? moments() : nullptr, m_window.data()});
            sum(exec, input, stride, parts, m_window.data());
        }
    }

    const Moments* moments() const { return m_moments[0].data(); }
    const SizeClasses* sizes() const { return m_sizes.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr int kPasses = 4;

    /// Enough parts to keep a GPU busy, whatever executor this is: the sums depend on it.
    static std::uint64_t partsOf(const SearchInput& input, std::uint64_t stride)
    {
        const std::uint64_t samples = (input.count + stride - 1) / stride;
        return std::clamp<std::uint64_t>(samples / 8, 1, 16384);
    }

    void sum(Exec& exec, const SearchInput& input, std::uint64_t stride, std::uint64_t parts,
             const CentreWindow* window)
    {
        exec.reserve(m_moments[0], parts);
        exec.reserve(m_moments[1], parts);
        exec.reserve(m_sizes, 1);
        exec.clear(m_sizes.data(), 1);
        exec.forEach(parts, SumBoxes{input.boxes, input.count, parts, stride, window, m_moments[0].data(),
                                     m_sizes.data()});
        while (parts > 1)
        {
            const std::uint64_t sums = (parts + SumMoments::kFanIn - 1) / SumMoments::kFanIn;
            exec.forEach(sums, SumMoments{m_moments[0].data(), parts, m_moments[1].data()});
            std::swap(m_moments[0], m_moments[1]);
            parts = sums;
        }
    }

    Buffer<CentreWindow> m_window;
    Buffer<Moments> m_moments[2];
    Buffer<SizeClasses> m_sizes;
};
}  // namespace cullet::psap
