// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/allowed_pairs.h"

#include "cullet/plugin/pair_sync/grown_box.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
AllowedPairs::AllowedPairs(const ProxyView& view, bool baselineSimd) : m_kernels(queryKernels(baselineSimd))
{
    growTo(view.size);
    for (std::uint32_t row = 0; row < view.size; ++row)
    {
        if (!isValid(view.boxes[row]))
            continue;
        m_largerBoxes[row] = grown(view.boxes[row], view.margin);
        m_isDue[row] = 1;
    }
}

void AllowedPairs::growTo(std::uint32_t rows)
{
    m_rows = rows;
    if (m_largerBoxes.size() >= rows)
        return;
    m_lists.growTo(rows);
    // The vector that is compared grows last: each may throw.
    m_isDue.resize(rows, 0);
    m_refused.resize(rows, 0);
    m_largerBoxes.resize(rows, kEmptyAabb);
}

/// Tests a listed pair, and reports it if it enters or leaves; returns whether it is held now.
bool AllowedPairs::test(std::uint32_t row, std::uint32_t other, bool isHeld, const ProxyView& view,
                        PairDelta& delta)
{
    const Aabb& box = view.boxes[row];
    const Aabb& otherBox = view.boxes[other];
    const bool areValid = isValid(box) && isValid(otherBox);
    ++m_tests;
    const bool isHeldNow =
        areValid && (isHeld ? overlapsWithMargin(box, otherBox, view.margin) : overlaps(box, otherBox));
    if (isHeldNow != isHeld)
        (isHeld ? delta.removed : delta.added)
            .push_back(makePair(view.uniqueIds[row], view.uniqueIds[other]));
    return isHeldNow;
}

/// Tests the listed pairs of changed rows: all in one pass, if many rows have changed.
void AllowedPairs::testChanged(const ProxyView& view, PairDelta& delta)
{
    if (m_lists.size() == 0)
        return;
    constexpr std::uint64_t kManyShare = 8;
    const bool testAll = m_isNew || kManyShare * view.dirtyCount > view.size;
    const std::uint32_t count = testAll ? view.size : view.dirtyCount;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint32_t row = testAll ? i : view.dirty[i];
        const auto testPair = [&](std::uint32_t other, bool isHeld)
        { return test(row, other, isHeld, view, delta); };
        if (testAll)
            m_lists.updateFlagsAbove(row, testPair);
        else
            m_lists.updateFlagsOf(row, testPair);
    }
    m_isNew = false;
}

/// Drops a destroyed row and its pairs, which have left.
void AllowedPairs::forget(std::uint32_t row) noexcept
{
    m_lists.eraseAllOf(row);
    setRefused(row, 0);
    m_largerBoxes[row] = kEmptyAabb;
    m_isDue[row] = 0;
}

/// Drops the listed pairs of the row whose larger boxes have parted, unless they are held.
void AllowedPairs::dropApart(std::uint32_t row)
{
    m_lists.eraseIf(row, [&](std::uint32_t other, bool isHeld)
                    { return !isHeld && !overlaps(m_largerBoxes[row], m_largerBoxes[other]); });
}

void AllowedPairs::update(const ProxyView& view, PairDelta& delta, std::vector<std::uint32_t>& due)
{
    delta.clear();
    m_tests = 0;
    growTo(view.size);
    testChanged(view, delta);
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if ((view.changes[row] & kRowDestroyed) != 0)
        {
            forget(row);
            continue;
        }
        const bool mustAsk = (view.changes[row] & (kRowCreated | kRowRefiltered)) != 0;
        if (!mustAsk && encloses(m_largerBoxes[row], view.boxes[row]))
            continue;
        const bool hasBox = isValid(view.boxes[row]);
        m_largerBoxes[row] = hasBox ? grown(view.boxes[row], view.margin) : kEmptyAabb;
        m_isDue[row] = hasBox;
        if (hasBox)
            due.push_back(view.uniqueIds[row]);
        else
            setRefused(row, 0);
        dropApart(row);
    }
    std::sort(delta.added.begin(), delta.added.end());
    std::sort(delta.removed.begin(), delta.removed.end());
}

void AllowedPairs::takePartners(std::uint32_t row, std::vector<std::uint32_t>& partners)
{
    partners.clear();
    if (row >= m_largerBoxes.size() || m_isDue[row] == 0)
        return;
    m_isDue[row] = 0;
    const auto rows = static_cast<std::uint32_t>(m_largerBoxes.size());
    const ScanView scan = {m_largerBoxes.data(), nullptr, rows};
    m_tests += rows;
    std::uint32_t found[kQueryBatch];
    std::uint32_t position = 0;
    for (;;)
    {
        const std::uint32_t count = m_kernels.scanOverlap(scan, m_largerBoxes[row], position, found);
        if (count == 0)
            break;
        for (const std::uint32_t* other = found; other != found + count; ++other)
        {
            // The coordinates of an empty box may overlap an infinite box.
            if (*other != row && m_isDue[*other] == 0 && isValid(m_largerBoxes[*other]))
                partners.push_back(*other);
        }
    }
    m_lists.removePartners(row, partners);
}

void AllowedPairs::setRefused(std::uint32_t row, std::uint32_t count) noexcept
{
    m_refusedSum += count;
    m_refusedSum -= m_refused[row];
    m_refused[row] = count;
}

std::uint64_t AllowedPairs::bytes() const noexcept
{
    return m_lists.bytes() + m_isDue.capacity() + m_refused.capacity() * sizeof(std::uint32_t) +
           m_largerBoxes.capacity() * sizeof(Aabb);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
