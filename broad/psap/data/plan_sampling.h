// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/search_input.h"

#include <algorithm>
#include <cstdint>

/// Shared parts of the planners, which make the next plan while the current one is in use.
namespace cullet::psap
{
/// A copy of a sample of the boxes, which may change as soon as the update has ended.
template <class Exec>
class BoxSample
{
public:
    /// @param most approximate number of boxes in the sample
    void keep(Exec& exec, const SearchInput& input, std::uint64_t most)
    {
        m_stride = strideFor(input, most);
        m_count = samplesOf(input, m_stride);
        exec.reserve(m_boxes, m_count);
        exec.forEach(m_count, KeepSample{input.boxes, m_stride, m_boxes.data()});
    }

    SearchInput boxes() const { return {m_boxes.data(), m_count}; }
    /// Boxes of the scene for each box of the sample.
    double stride() const { return static_cast<double>(m_stride); }

    static std::uint64_t strideFor(const SearchInput& input, std::uint64_t most)
    {
        return std::max<std::uint64_t>(1, input.count / most);
    }

private:
    std::uint64_t m_stride = 1;
    std::uint64_t m_count = 0;
    typename Exec::template Buffer<Aabb> m_boxes;
};

/// A word that the device writes and the CPU polls without waiting.
template <class Exec>
class ResultMailbox
{
public:
    bool isReserved() const { return m_mailbox.size() != 0; }
    void reserve(Exec& exec)
    {
        exec.reserve(m_mailbox, 1);
        *m_mailbox.data() = 0;
    }
    /// @param word in the executor's memory
    void request(Exec& exec, const std::uint64_t* word) { exec.download(m_mailbox.data(), word, 1); }

    /// Reads the last word that has arrived; 0 before the first one.
    void poll()
    {
        if (isReserved())
            m_value = *static_cast<const volatile std::uint64_t*>(m_mailbox.data());
    }
    std::uint64_t value() const { return m_value; }

private:
    std::uint64_t m_value = 0;
    typename Exec::template Staging<std::uint64_t> m_mailbox;
};
}  // namespace cullet::psap
