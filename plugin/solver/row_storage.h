// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <cstddef>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Memory for rows, which is not cleared: setting up writes all of them.
template <class Row>
class RowStorage
{
public:
    /// Makes room for `count` rows; what was there is lost.
    void allocate(std::size_t count)
    {
        if (count <= m_capacity)
            return;
        m_rows.reset();
        m_capacity = 0;
        m_rows.reset(new Row[count + count / 4]);
        m_capacity = count + count / 4;
    }

    Row* data() { return m_rows.get(); }
    const Row* data() const { return m_rows.get(); }

private:
    std::unique_ptr<Row[]> m_rows;
    std::size_t m_capacity = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
