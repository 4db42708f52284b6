// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/fuzz/box_model.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace cullet::test
{
/// A proxy table and the model of what it should hold.
class TableTwin
{
public:
    ProxyTable& table() { return m_table; }
    const BoxModel& model() const { return m_model; }

    void create(const Aabb& box, std::uint32_t id, Filter filter)
    {
        const ProxyId row = m_table.create(box, id, filter);
        m_model.create(row, id, box, filter);
    }

    /// @param index among the live ones
    void destroy(std::size_t index)
    {
        m_table.destroy(m_model.live()[index]);
        m_model.destroy(index);
    }

    void setBox(ProxyId row, const Aabb& box)
    {
        m_table.setBox(row, box);
        m_model.setBox(row, box);
    }

    /// @param boxes row -> box; equal ones need not become dirty
    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<ProxyId>& rows)
    {
        m_table.setBoxes(boxes.data(), rows.data(), rows.size());
        for (const ProxyId row : rows)
            if (boxes[row] != m_model.at(row).box)
                m_model.setBox(row, boxes[row]);
    }

    void setFilter(ProxyId row, Filter filter)
    {
        m_table.setFilter(row, filter);
        m_model.setFilter(row, filter);
    }

    void clear()
    {
        m_table.clear();
        m_model.clear();
    }

    void hold(const Pairs& pairs) { m_model.hold(pairs); }
    PairDelta updateModel(float margin, bool useFilter) { return m_model.update(margin, useFilter); }

    /// Collects the rows for queries; returns what is wrong with them, if anything.
    std::string collectForQueries()
    {
        Array<ProxyId> rows;
        m_table.collectQueryChanges(rows);
        for (ProxyId row = 0; row < m_model.size(); ++row)
        {
            BoxModel::Proxy& proxy = m_model.at(row);
            if (proxy.isUncollected && !std::binary_search(rows.begin(), rows.end(), row))
                return "row " + std::to_string(row) + " not collected for queries";
            proxy.isUncollected = false;
        }
        const auto* unordered = std::adjacent_find(rows.begin(), rows.end(), std::greater_equal<ProxyId>());
        return m_table.hasQueryChanges() || unordered != rows.end() ? "rows for queries not in order, or more"
                                                                    : "";
    }

    /// What is wrong with the view of an update, if anything.
    std::string faultOf(const ProxyView& view)
    {
        if (m_table.liveCount() != m_model.live().size() || view.size < m_model.size())
            return "table counts " + std::to_string(m_table.liveCount()) + " proxies";
        for (ProxyId row = 0; row < m_model.size(); ++row)
        {
            BoxModel::Proxy& proxy = m_model.at(row);
            if (proxy.isChanged && !std::binary_search(view.dirty, view.dirty + view.dirtyCount, row))
                return "row " + std::to_string(row) + " is not dirty";
            if (proxy.id != 0 && view.uniqueIds[row] != proxy.id)
                return "row " + std::to_string(row) + " has another id";
            if (proxy.id == 0 && isValid(view.boxes[row]))
                return "row " + std::to_string(row) + " has a box and no proxy";
            proxy.isChanged = false;
        }
        return "";
    }

private:
    ProxyTable m_table;
    BoxModel m_model;
};
}  // namespace cullet::test
