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
    void collect(Exec& exec, SearchInput input, std::uint64_t stride)
    {
        // Enough parts to keep a GPU busy, whatever executor this is: the sums depend on it.
        const std::uint64_t samples = (input.count + stride - 1) / stride;
        std::uint64_t parts = std::clamp<std::uint64_t>(samples / 8, 1, 16384);
        exec.reserve(m_moments[0], parts);
        exec.reserve(m_moments[1], parts);
        exec.reserve(m_sizes, 1);
        exec.clear(m_sizes.data(), 1);
        exec.forEach(parts,
                     SumBoxes{input.boxes, input.count, parts, stride, m_moments[0].data(), m_sizes.data()});
        while (parts > 1)
        {
            const std::uint64_t sums = (parts + SumMoments::kFanIn - 1) / SumMoments::kFanIn;
            exec.forEach(sums, SumMoments{m_moments[0].data(), parts, m_moments[1].data()});
            std::swap(m_moments[0], m_moments[1]);
            parts = sums;
        }
    }

    const Moments* moments() const { return m_moments[0].data(); }
    const SizeClasses* sizes() const { return m_sizes.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    Buffer<Moments> m_moments[2];
    Buffer<SizeClasses> m_sizes;
};
}  // namespace cullet::psap
