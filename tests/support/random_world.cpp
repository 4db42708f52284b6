// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/random_world.h"

#include "cullet/tests/support/boxes.h"

#include <cmath>

namespace cullet::test
{
RandomWorld::RandomWorld(std::uint32_t seed, const RandomWorldOptions& worldOptions, ProxyTable& table)
    : options(worldOptions), m_table(table), m_random(seed), m_nextId(worldOptions.firstId)
{
    createSome(options.count);
}

float RandomWorld::snapped(float value) const
{
    return options.isSnapped ? std::floor(value * 16.0f) / 16.0f : value;
}

Aabb RandomWorld::randomBox()
{
    Aabb box;
    // One size for all axes in two of three boxes; the rest are plates and rods.
    const bool isCube = m_random.below(3) != 0;
    const float size = m_random.logUniform(options.sizeLow, options.sizeHigh);
    for (int axis = 0; axis < 3; ++axis)
    {
        const float extent = isCube ? size : m_random.logUniform(options.sizeLow, options.sizeHigh);
        box.min[axis] = options.shift[axis] + snapped(m_random.between(-options.halfSide, options.halfSide));
        box.max[axis] = box.min[axis] + snapped(extent);
    }
    return box;
}

Aabb RandomWorld::specialBox()
{
    Aabb box = randomBox();
    const std::uint32_t axis = m_random.below(3);
    switch (m_random.below(7))
    {
        case 0:  // point
            for (int i = 0; i < 3; ++i)
                box.max[i] = box.min[i];
            break;
        case 1:
            std::swap(box.min[axis], box.max[axis]);
            break;
        case 2:
            (m_random.chance(0.5f) ? box.min : box.max)[axis] = kNan;
            break;
        case 3:
            box = cube(-1e18f, 1e18f);
            break;
        case 4:
            box = cube(-1e30f, 1e30f);
            break;
        case 5:  // half space
            (m_random.chance(0.5f) ? box.min[axis] = -kInfinity : box.max[axis] = kInfinity);
            break;
        default:
            box = cube(-kInfinity, kInfinity);
    }
    return box;
}

Filter RandomWorld::randomFilter()
{
    // Two of three proxies pair with everything; the rest are like static bodies or members of one of four groups.
    switch (m_random.below(6))
    {
        case 0:
            return {2, ~2};
        case 1:
            return {1 << m_random.below(4), static_cast<std::int32_t>(m_random.below(16))};
        default:
            return kEverything;
    }
}

void RandomWorld::create()
{
    const Filter filter = randomFilter();
    const Aabb box = m_random.chance(options.special) ? specialBox() : randomBox();
    m_rows.push_back(m_table.create(box, m_nextId++, filter));
    ++m_counts.created;
}

void RandomWorld::createSome(std::uint32_t count)
{
    for (std::uint32_t i = 0; i < count; ++i)
        create();
}

void RandomWorld::destroyAll()
{
    for (const ProxyId row : m_rows)
        m_table.destroy(row);
    m_counts.destroyed += m_rows.size();
    m_rows.clear();
}

void RandomWorld::change(std::size_t index)
{
    const ProxyId row = m_rows[index];
    if (m_random.chance(options.move))
    {
        const float x = snapped(m_random.between(-options.stride, options.stride));
        const float y = snapped(m_random.between(-options.stride, options.stride));
        const float z = snapped(m_random.between(-options.stride, options.stride));
        m_table.setBox(row, translated(m_table.box(row), x, y, z));
        ++m_counts.moved;
    }
    if (m_random.chance(options.teleport))
    {
        m_table.setBox(row, randomBox());
        ++m_counts.teleported;
    }
    if (m_random.chance(options.resize))
    {
        Aabb box = m_table.box(row);
        for (int axis = 0; axis < 3; ++axis)
            box.max[axis] = box.min[axis] + snapped(m_random.logUniform(options.sizeLow, options.sizeHigh));
        m_table.setBox(row, box);
        ++m_counts.resized;
    }
    if (m_random.chance(options.special))
    {
        m_table.setBox(row, specialBox());
        ++m_counts.special;
    }
    if (m_random.chance(options.refilter))
    {
        m_table.setFilter(row, randomFilter());
        ++m_counts.refiltered;
    }
    if (m_random.chance(options.resend))
        m_table.setBox(row, Aabb(m_table.box(row)));
}

void RandomWorld::step()
{
    for (std::size_t index = 0; index < m_rows.size(); ++index)
        change(index);
    for (std::size_t index = 0; index < m_rows.size();)
    {
        if (m_random.chance(options.destroy))
        {
            m_table.destroy(m_rows[index]);
            m_rows[index] = m_rows.back();
            m_rows.pop_back();
            ++m_counts.destroyed;
        }
        else
        {
            ++index;
        }
    }
    while (m_rows.size() < options.count && m_random.chance(0.7f))
        create();
}
}  // namespace cullet::test
