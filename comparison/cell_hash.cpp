// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/cell_hash.h"

namespace cullet
{
namespace
{
// First number of slots, odd as all later ones (2n + 1): an odd modulus depends on all bits of the hash, while a power
// of two would select the low bits of the products, which depend on the low bits of i, j, k only.
constexpr std::uint32_t kFirstSlotCount = 31;
}  // namespace

CellHash::CellHash(GridStorage storage, std::uint32_t slotCount)
    : m_storage(storage), m_isGrowing(slotCount == 0 || storage == GridStorage::OpenAddressing)
{
    const std::uint32_t wanted = slotCount == 0 ? kFirstSlotCount : slotCount;
    while (8 * m_side * m_side * m_side <= wanted)
        m_side *= 2;
    m_slots.assign(storage == GridStorage::Array ? m_side * m_side * m_side : wanted, kNone);
}

std::uint32_t CellHash::slotOf(const CellNumber& cell) const
{
    if (m_storage != GridStorage::Array)
        return cellHash(cell) % static_cast<std::uint32_t>(m_slots.size());
    std::uint32_t slot = 0;
    for (int axis = 2; axis >= 0; --axis)
        slot = slot * m_side + (static_cast<std::uint32_t>(cell[axis]) & (m_side - 1));
    return slot;
}

std::uint32_t CellHash::find(const CellNumber& cell) const
{
    std::uint32_t slot = slotOf(cell);
    std::uint32_t place = m_slots[slot];
    const bool isProbing = m_storage == GridStorage::OpenAddressing;
    while (place != kNone && !isAt(place, cell))
    {
        slot = slot + 1 == m_slots.size() ? 0 : slot + 1;
        place = isProbing ? m_slots[slot] : m_keys[place].next;
    }
    return place;
}

void CellHash::insert(const CellNumber& cell, std::uint32_t place)
{
    // Open addressing needs free slots between its cells.
    if (m_isGrowing &&
        (m_storage == GridStorage::OpenAddressing ? 2 * m_count + 2 : m_count) >= m_slots.size())
        grow();
    if (place >= m_keys.size())
        m_keys.resize(std::max<std::size_t>(place + 1, 2 * m_keys.size()));
    std::copy(cell, cell + 3, m_keys[place].cell);
    link(place);
    ++m_count;
}

void CellHash::link(std::uint32_t place)
{
    std::uint32_t slot = slotOf(m_keys[place].cell);
    if (m_storage == GridStorage::OpenAddressing)
    {
        while (m_slots[slot] != kNone)
            slot = slot + 1 == m_slots.size() ? 0 : slot + 1;
    }
    m_keys[place].next = m_slots[slot];
    m_slots[slot] = place;
}

void CellHash::erase(std::uint32_t place)
{
    unlink(place);
    --m_count;
}

void CellHash::unlink(std::uint32_t place)
{
    std::uint32_t slot = slotOf(m_keys[place].cell);
    if (m_storage == GridStorage::OpenAddressing)
    {
        while (m_slots[slot] != place)
            slot = slot + 1 == m_slots.size() ? 0 : slot + 1;
        shiftBack(slot);
        return;
    }
    std::uint32_t* link = &m_slots[slot];
    while (*link != place)
        link = &m_keys[*link].next;
    *link = m_keys[place].next;
}

/// Backward-shift deletion: moves cells that were probed past the free slot back into it, so that no tombstones
/// accumulate.
void CellHash::shiftBack(std::uint32_t hole)
{
    const std::uint32_t count = static_cast<std::uint32_t>(m_slots.size());
    const auto distance = [count](std::uint32_t from, std::uint32_t to)
    { return to >= from ? to - from : to + count - from; };
    for (std::uint32_t next = hole + 1 == count ? 0 : hole + 1; m_slots[next] != kNone;
         next = next + 1 == count ? 0 : next + 1)
    {
        if (distance(slotOf(m_keys[m_slots[next]].cell), next) < distance(hole, next))
            continue;
        m_slots[hole] = m_slots[next];
        hole = next;
    }
    m_slots[hole] = kNone;
}

void CellHash::grow()
{
    std::vector<std::uint32_t> places;
    places.reserve(m_count);
    for (std::uint32_t place : m_slots)
    {
        for (; place != kNone; place = nextInChain(place))
            places.push_back(place);
    }
    if (m_storage == GridStorage::Array)
        m_side *= 2;
    m_slots.assign(m_storage == GridStorage::Array ? m_side * m_side * m_side : 2 * m_slots.size() + 1,
                   kNone);
    for (const std::uint32_t place : places)
        link(place);
}

void CellHash::clear()
{
    std::fill(m_slots.begin(), m_slots.end(), kNone);
    m_keys.clear();
    m_count = 0;
}

std::uint64_t CellHash::bytes() const
{
    return m_slots.capacity() * sizeof(std::uint32_t) + m_keys.capacity() * sizeof(Key);
}
}  // namespace cullet
