// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Fingerprints of the work of queries after a fixed history: rows that were scanned, trees that were built, boxes that
// were visited and in which order. Any tree finds the same boxes, so that a poor one, or one that is built too late,
// shows here alone. After a change of a tree or a cost insert the new values, and say in the commit what they gain.

#include "cullet/tests/broad/queries/query_checks.h"
#include "cullet/tests/support/fnv1a.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

namespace cullet::test
{
namespace
{
/// A crowd of boxes of all sizes, some of them without bounds, and the queries after each change.
class QueryHistory
{
public:
    explicit QueryHistory(QueryMode mode) : m_index(m_table, {mode, true})
    {
        for (std::uint32_t id = 1; id <= 3000; ++id)
            m_table.create(randomBox(), id, kFilter);
    }

    /// Phases of one kind of change each: none, a few moves, many, teleports, new boxes, fewer boxes.
    void run()
    {
        for (int round = 0; round < 3; ++round)
        {
            repeat(20, [] {});
            repeat(60, [&] { move(anyRow(), 0.25f); });
            repeat(6,
                   [&]
                   {
                       for (ProxyId row = 0; row < m_table.size(); ++row)
                           move(row, 0.125f);
                   });
            repeat(40,
                   [&]
                   {
                       const Aabb box = randomBox();
                       setBox(anyRow(), box);
                   });
            repeat(30,
                   [&]
                   {
                       for (int i = 0; i < 20; ++i)
                           m_table.create(randomBox(), m_nextId++, kFilter);
                   });
            repeat(30,
                   [&]
                   {
                       const ProxyId row = anyRow();
                       if (m_table.uniqueId(row) != 0 && isValid(m_table.box(row)))
                           m_table.destroy(row);
                   });
            m_table.beginUpdate(0, true);
            m_table.endUpdate();
        }
    }

    std::string text() const
    {
        std::ostringstream out;
        out << m_index.scannedRowsTotal() << " scanned, " << m_index.builtRowsTotal() << " built in "
            << m_index.buildsTotal() << " builds and " << m_index.syncsTotal() << " syncs, " << m_visits
            << " visits, " << std::hex << m_order.value();
        return out.str();
    }

private:
    template <class Change>
    void repeat(int times, const Change& change)
    {
        for (int i = 0; i < times; ++i)
        {
            change();
            ask();
        }
    }

    Aabb randomBox()
    {
        const float half = m_random.below(100) == 0 ? 8.0f : m_random.below(4) == 0 ? 0.0625f : 0.5f;
        if (m_random.below(500) == 0)
            return cube(0, 0, 0, 1e18f);
        return anyCube(m_random, 0, 40, half);
    }

    ProxyId anyRow() { return m_random.below(m_table.size()); }

    void move(ProxyId row, float way)
    {
        Aabb box = m_table.box(row);
        const int axis = static_cast<int>(m_random.below(3));
        const float shift = m_random.below(2) == 0 ? way : -way;
        box.min[axis] += shift;
        box.max[axis] += shift;
        setBox(row, box);
    }

    void setBox(ProxyId row, const Aabb& box)
    {
        if (m_table.uniqueId(row) != 0 && isValid(m_table.box(row)))
            m_table.setBox(row, box);
    }

    void ask()
    {
        const auto visit = [&](ProxyId row)
        {
            ++m_visits;
            m_order.add(row, sizeof row);
        };
        m_index.forEachOverlap(anyCube(m_random, 0, 40, 2), visit);
        const Aabb from = anyCube(m_random, 0, 40, 0);
        const Aabb direction = anyCube(m_random, -1, 1, 0);
        m_index.forEachOnRay(rayAlong(from.min, direction.min, 10), visit);
    }

    ProxyTable m_table;
    QueryIndex m_index;
    QueryRandom m_random{29};
    std::uint32_t m_nextId = 10000;
    std::uint64_t m_visits = 0;
    Fnv1a m_order;
};

TEST(QueryWork, IsTheRecordedOneAfterAFixedHistory)
{
    struct Recorded
    {
        QueryMode mode;
        const char* text;
    };
    const Recorded records[] = {
        {QueryMode::Automatic,
         "442951 scanned, 27708 built in 7 builds and 454 syncs, 18068 visits, 4971584678d182a3"},
        {QueryMode::Tree,
         "30131 scanned, 28643 built in 7 builds and 498 syncs, 18068 visits, 66c76ccb06337813"},
        {QueryMode::Scan,
         "4163080 scanned, 0 built in 0 builds and 0 syncs, 18046 visits, 5fb6e139b8c9801e"}};
    for (const Recorded& recorded : records)
    {
        QueryHistory history(recorded.mode);
        history.run();
        EXPECT_EQ(history.text(), recorded.text);
    }
}
}  // namespace
}  // namespace cullet::test
