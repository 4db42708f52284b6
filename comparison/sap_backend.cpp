// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/sap_backend.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/pairs/restart_rows.h"
#include "cullet/comparison/backends.h"

#include <algorithm>
#include <new>

namespace cullet
{
namespace
{
constexpr std::size_t kAxes = 3;

std::uint32_t firstRow(std::uint64_t key)
{
    return static_cast<std::uint32_t>(key >> 32);
}

std::uint32_t secondRow(std::uint64_t key)
{
    return static_cast<std::uint32_t>(key);
}
}  // namespace

void SapBackend::OpenIntervals::add(std::uint32_t row, const Aabb& box, std::vector<std::uint32_t>& places)
{
    places[row] = static_cast<std::uint32_t>(rows.size());
    rows.push_back(row);
    boxes.push_back(box);
}

void SapBackend::OpenIntervals::remove(std::uint32_t row, std::vector<std::uint32_t>& places)
{
    const std::uint32_t place = places[row];
    rows[place] = rows.back();
    boxes[place] = boxes.back();
    places[rows[place]] = place;
    rows.pop_back();
    boxes.pop_back();
}

void SapBackend::OpenIntervals::clear()
{
    rows.clear();
    boxes.clear();
}

void SapBackend::restart(const Pairs& known)
{
    m_known = known;
    m_needsRebuild = true;
}

/// Discards all boxes and holds the pairs given to restart().
void SapBackend::begin(const ProxyView& proxies)
{
    for (EndpointList& axis : m_axes)
        axis.clear();
    m_boxes.clear();
    m_overlapping.reset(0);
    m_held.reset(m_known.size());
    // An update that failed may have left entries in these.
    m_toReevaluate.clear();
    m_touched.clear();
    m_openNew.clear();
    m_openOld.clear();
    for (const KeyedPair& pair : findRowsOf(m_known, proxies))
    {
        if (pair.firstRow == kNoRow || pair.secondRow == kNoRow)
        {
            m_expired.push_back(pair.ids);
            continue;
        }
        m_toReevaluate.push_back(rowKey({pair.firstRow, pair.secondRow}));
        m_held.insert(m_toReevaluate.back());
    }
    m_known = {};
    m_needsRebuild = false;
}

void SapBackend::classifyRow(const ProxyView& proxies, std::uint32_t row)
{
    const Aabb& before = m_boxes[row];
    const Aabb& after = proxies.boxes[row];
    const bool wasValid = isValid(before);
    const bool isNowValid = isValid(after);
    const bool overlapsOldBox = wasValid && isNowValid && overlaps(before, after);
    if (overlapsOldBox)
        m_moving.push_back(row);
    if (wasValid && !overlapsOldBox)
        m_leaving.push_back(row);
    if (isNowValid && !overlapsOldBox)
        m_entering.push_back(row);
}

void SapBackend::removeLeaving()
{
    if (m_leaving.empty())
        return;
    m_isLeaving.assign(m_boxes.size(), 0);
    for (const std::uint32_t row : m_leaving)
    {
        m_isLeaving[row] = 1;
        m_boxes[row] = kEmptyAabb;
    }
    for (EndpointList& axis : m_axes)
        axis.remove(m_isLeaving);
    const std::size_t firstEnded = m_touched.size();
    m_overlapping.forEach(
        [&](const KeySlot& slot)
        {
            if (m_isLeaving[firstRow(slot.key)] != 0 || m_isLeaving[secondRow(slot.key)] != 0)
                m_touched.push_back(slot.key);
        });
    for (std::size_t i = firstEnded; i < m_touched.size(); ++i)
        m_overlapping.erase(m_touched[i]);
}

void SapBackend::addOverlap(std::uint64_t key)
{
    if (m_overlapping.contains(key))
        return;
    m_overlapping.insert(key);
    m_touched.push_back(key);
}

void SapBackend::moveBox(std::uint32_t row, const Aabb& box)
{
    m_boxes[row] = box;
    const auto onEvent = [&](std::uint32_t other, EndpointEvent event)
    {
        const std::uint64_t key = rowKey({row, other});
        if (event == EndpointEvent::OverlapEnds)
        {
            if (m_overlapping.erase(key))
                m_touched.push_back(key);
            return;
        }
        ++m_stats.candidates;
        if (overlaps(box, m_boxes[other]))
            addOverlap(key);
    };
    for (EndpointList& axis : m_axes)
        axis.move(row, box, onEvent);
}

/// Returns how many tests a sweep over an axis would make, by counting the open intervals.
std::uint64_t SapBackend::countTestsAlong(const EndpointList& axis) const
{
    std::uint64_t open[2] = {0, 0};  // old, new
    std::uint64_t tests = 0;
    for (const EndpointList::Endpoint& endpoint : axis.endpoints())
    {
        const std::uint8_t isNew = m_isEntering[endpoint.row()];
        if (endpoint.side() == EndpointSide::End)
        {
            --open[isNew];
            continue;
        }
        tests += isNew != 0 ? open[0] + open[1] : open[1];
        ++open[isNew];
    }
    return tests;
}

void SapBackend::testOpen(std::uint32_t row, const OpenIntervals& open)
{
    const Aabb& box = m_boxes[row];
    m_stats.candidates += open.rows.size();
    for (std::size_t i = 0; i < open.rows.size(); ++i)
    {
        if (overlaps(box, open.boxes[i]))
            addOverlap(rowKey({row, open.rows[i]}));
    }
}

/// Finds the pairs of the new boxes: "when adding a new start to the set, report all boxes of the set" (Lesson 04).
void SapBackend::sweep(const EndpointList& axis)
{
    m_openPlaces.resize(m_boxes.size());
    for (const EndpointList::Endpoint& endpoint : axis.endpoints())
    {
        const std::uint32_t row = endpoint.row();
        const bool isNew = m_isEntering[row] != 0;
        OpenIntervals& own = isNew ? m_openNew : m_openOld;
        if (endpoint.side() == EndpointSide::End)
        {
            own.remove(row, m_openPlaces);
            continue;
        }
        testOpen(row, m_openNew);
        if (isNew)
            testOpen(row, m_openOld);
        own.add(row, m_boxes[row], m_openPlaces);
    }
}

void SapBackend::insertEntering(const ProxyView& proxies)
{
    if (m_entering.empty())
        return;
    m_stats.path = "batch";
    m_isEntering.assign(m_boxes.size(), 0);
    for (const std::uint32_t row : m_entering)
    {
        m_isEntering[row] = 1;
        m_boxes[row] = proxies.boxes[row];
    }
    std::uint64_t tests[kAxes];
    for (std::size_t axis = 0; axis < kAxes; ++axis)
    {
        m_axes[axis].insert(m_entering, m_boxes);
        tests[axis] = countTestsAlong(m_axes[axis]);
    }
    sweep(m_axes[static_cast<std::size_t>(std::min_element(tests, tests + kAxes) - tests)]);
}

void SapBackend::applyChanges(const ProxyView& proxies)
{
    m_moving.clear();
    m_leaving.clear();
    m_entering.clear();
    const bool needsRebuild = m_needsRebuild;
    if (needsRebuild)
        begin(proxies);
    m_boxes.resize(proxies.size, kEmptyAabb);
    const std::uint32_t count = needsRebuild ? proxies.size : proxies.dirtyCount;
    for (std::uint32_t i = 0; i < count; ++i)
        classifyRow(proxies, needsRebuild ? i : proxies.dirty[i]);
    removeLeaving();
    for (const std::uint32_t row : m_moving)
        moveBox(row, proxies.boxes[row]);
    insertEntering(proxies);
}

/// Applies the rules of Backend to the pairs whose overlap changed, and to those held or excluded despite their boxes.
void SapBackend::applyPairRules(const ProxyView& proxies, PairDelta& delta)
{
    m_touched.insert(m_touched.end(), m_toReevaluate.begin(), m_toReevaluate.end());
    std::sort(m_touched.begin(), m_touched.end());
    m_touched.erase(std::unique(m_touched.begin(), m_touched.end()), m_touched.end());
    m_toReevaluate.clear();
    delta.removed.swap(m_expired);
    for (const std::uint64_t key : m_touched)
    {
        const std::uint32_t a = firstRow(key), b = secondRow(key);
        const bool isOverlapping = m_overlapping.contains(key);
        bool isHeld = m_held.contains(key);
        const Pair ids = makePair(proxies.uniqueIds[a], proxies.uniqueIds[b]);
        if (isOverlapping && !isHeld &&
            (proxies.filters == nullptr || passesFilter(proxies.filters[a], proxies.filters[b])))
        {
            m_held.insert(key);
            delta.added.push_back(ids);
            isHeld = true;
        }
        else if (isHeld && !isOverlapping &&
                 !(isValid(m_boxes[a]) && isValid(m_boxes[b]) &&
                   overlapsWithMargin(m_boxes[a], m_boxes[b], proxies.margin)))
        {
            m_held.erase(key);
            delta.removed.push_back(ids);
            isHeld = false;
        }
        if (isHeld != isOverlapping)
            m_toReevaluate.push_back(key);
    }
    m_touched.clear();
    std::sort(delta.added.begin(), delta.added.end());
    std::sort(delta.removed.begin(), delta.removed.end());
}

Status SapBackend::update(const ProxyView& proxies, PairDelta& delta)
try
{
    delta.clear();
    m_expired.clear();
    m_stats.candidates = 0;
    m_stats.path = "idle";
    std::uint64_t swaps[kAxes];
    for (std::size_t axis = 0; axis < kAxes; ++axis)
        swaps[axis] = m_axes[axis].swapsTotal();
    if (m_needsRebuild || proxies.dirtyCount != 0 || proxies.margin != m_margin)
    {
        m_stats.path = "incremental";
        m_margin = proxies.margin;
        applyChanges(proxies);
        applyPairRules(proxies, delta);
    }
    for (std::size_t axis = 0; axis < kAxes; ++axis)
        m_comparisonStats.swaps[axis] = m_axes[axis].swapsTotal() - swaps[axis];
    return Status::Ok;
}
catch (const std::bad_alloc&)
{
    restart({});
    delta.clear();
    return Status::OutOfMemory;
}

BackendStats SapBackend::stats() const
{
    BackendStats stats = m_stats;
    stats.pairs = m_held.count();
    stats.bytes = m_overlapping.bytes() + m_held.bytes() +
                  bytesOf(m_boxes, m_toReevaluate, m_touched, m_moving, m_leaving, m_entering, m_isLeaving,
                          m_isEntering, m_openNew.rows, m_openNew.boxes, m_openOld.rows, m_openOld.boxes,
                          m_openPlaces, m_known, m_expired);
    for (const EndpointList& axis : m_axes)
    {
        stats.entries += axis.endpoints().size();
        stats.bytes += axis.bytes();
    }
    return stats;
}

std::unique_ptr<Backend> makeSapBackend()
{
    return std::make_unique<SapBackend>();
}
}  // namespace cullet
