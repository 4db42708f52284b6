// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/update/upload_steps.h"

#include <cstdint>

namespace cullet::psap
{
/// The filter words of a proxy table's rows in an executor's memory. An update without words discards them.
template <class Exec>
class FilterMirror
{
public:
    /// Makes the next send() upload the words of all rows.
    void forget() { m_hasWords = false; }

    void reserve(Exec& exec, std::uint64_t room, std::uint64_t rowsInUse)
    {
        exec.reserveKeeping(m_words, room, m_hasWords ? rowsInUse : 0);
    }

    /// By row; null: the last send() had none.
    const Filter* words() const { return m_hasWords ? m_words.data() : nullptr; }

    /// Uploads the words of `count` changed rows, in the order of the dirty list of `view`.
    ///
    /// @param areNew some of the rows have new words
    /// @param rows   the dirty list in the executor's memory; null: all rows have changed
    void send(Exec& exec, const ProxyView& view, bool areNew, const std::uint32_t* rows, std::uint64_t count)
    {
        const bool hadWords = m_hasWords;
        m_hasWords = view.filters != nullptr;
        if (!m_hasWords)
            return;
        // Words that changed while no filter was set were not uploaded.
        if (!hadWords)
            exec.uploadAndWait(m_words.data(), view.filters, view.size);
        else if (areNew)
            sendChanged(exec, view, rows, count);
    }

private:
    void sendChanged(Exec& exec, const ProxyView& view, const std::uint32_t* rows, std::uint64_t count)
    {
        exec.reserve(m_changed, count);
        exec.reserve(m_staged, count);
        for (std::uint64_t i = 0; i < count; ++i)
            m_staged.data()[i] = view.filters[rows == nullptr ? i : view.dirty[i]];
        exec.upload(m_changed.data(), m_staged.data(), count);
        exec.forEach(count, ApplyFilter{rows, m_changed.data(), m_words.data()});
    }

    bool m_hasWords = false;
    typename Exec::template Buffer<Filter> m_words, m_changed;
    typename Exec::template Staging<Filter> m_staged;
};
}  // namespace cullet::psap
