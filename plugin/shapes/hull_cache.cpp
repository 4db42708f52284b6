// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/hull_cache.h"

#include "cullet/base/held_while_forking.h"
#include "cullet/narrow/build/hull_builder.h"

#include <algorithm>
#include <cstring>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::size_t byteCount(const btConvexHullShape& shape)
{
    return sizeof(btVector3) * static_cast<std::size_t>(shape.getNumPoints());
}

/// Four independent chains of multiplications, since a single chain would be bound by latency.
std::uint64_t hashOf(const void* data, std::size_t bytes)
{
    constexpr std::uint64_t kPrime = 0x9e3779b97f4a7c15ull;
    std::uint64_t lanes[4] = {1, 2, 3, 4};
    const char* p = static_cast<const char*>(data);
    for (std::size_t i = 0; i < bytes / 8; ++i)
    {
        std::uint64_t word;
        std::memcpy(&word, p + 8 * i, 8);
        std::uint64_t& lane = lanes[i % 4];
        lane = (lane ^ word) * kPrime;
        lane ^= lane >> 29;
    }
    std::uint64_t hash = bytes;
    for (const std::uint64_t lane : lanes)
        hash = (hash ^ lane) * kPrime;
    return hash ^ hash >> 32;
}
}  // namespace

HullContents::HullContents(const btConvexHullShape& shape)
    : m_pointCount(static_cast<std::size_t>(shape.getNumPoints()))
{
    if (m_pointCount == 0)
        return;
    const btScalar* const first = shape.getUnscaledPoints()->m_floats;
    m_cloud = makeCloud(first, shape.getNumPoints(), static_cast<std::int32_t>(kScalarsPerPoint));
    const std::size_t bytes = byteCount(shape);
    if (m_cloud.vertexCount() == 0 || !areEqualBytes(m_cloud.lanes(0), first, bytes))
        m_points.assign(first, first + bytes / sizeof(btScalar));
}

std::vector<Eigen::Matrix<btScalar, 3, 1>> HullContents::xyzPoints() const
{
    std::vector<Eigen::Matrix<btScalar, 3, 1>> xyz;
    xyz.reserve(m_pointCount);
    const btScalar* const first = points();
    for (std::size_t i = 0; i < m_pointCount * kScalarsPerPoint; i += kScalarsPerPoint)
        xyz.emplace_back(first[i], first[i + 1], first[i + 2]);
    return xyz;
}

const Hull<btScalar>& HullContents::graph(bool& isFirst)
{
    isFirst = false;
    std::call_once(m_isBuilt,
                   [this, &isFirst]
                   {
                       m_graph = makeCornerHull(xyzPoints());
                       isFirst = true;
                   });
    return m_graph;
}

HullCache& HullCache::instance()
{
    // Never destroyed, since shapes may outlive it otherwise; placed in static memory, since allocation may fail.
    alignas(HullCache) static unsigned char place[sizeof(HullCache)];
    static HullCache* const cache = []
    {
        HullCache* const made = new (place) HullCache;
        holdWhileForking(made->m_mutex);
        return made;
    }();
    return *cache;
}

HullRecord* HullCache::acquire(const btConvexHullShape& shape) noexcept
try
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    std::unique_ptr<HullRecord>& record = m_records[&shape];
    bool isNew = false;
    if (!record)
    {
        record = std::make_unique<HullRecord>();
        record->shape = &shape;
        isNew = true;
    }
    HullRecord* const found = record.get();
    found->references.fetch_add(1, std::memory_order_relaxed);
    if (isNew)
        add(kFixedWeight);
    return found;
}
catch (const std::bad_alloc&)
{
    return nullptr;
}

/// @pre a pair uses the added record or contents
void HullCache::add(std::size_t weight) noexcept
{
    m_addedWeight += weight;
    if (m_addedWeight > m_sweepAt)
        sweep();
}

/// Removes all that no pair uses. The next sweep follows after adding as much as is left: amortised O(1).
void HullCache::sweep() noexcept
{
    std::size_t left = 0;
    for (auto it = m_records.begin(); it != m_records.end();)
    {
        const bool isUsed = !it->second || it->second->isPinned || it->second->isDeforming ||
                            it->second->references.load(std::memory_order_acquire) != 0;
        left += isUsed ? kFixedWeight : 0;
        it = isUsed ? std::next(it) : m_records.erase(it);
    }
    for (auto it = m_contents.begin(); it != m_contents.end();)
    {
        // The memory block of destroyed contents is freed only when its weak_ptr is erased.
        const std::shared_ptr<HullContents> contents = it->second.lock();
        left += contents ? weightOf(*contents) : 0;
        it = contents ? std::next(it) : m_contents.erase(it);
    }
    m_addedWeight = 0;
    m_sweepAt = std::max(kLeastAdded, left);
}

std::shared_ptr<HullContents> HullCache::contentsOf(const btConvexHullShape& shape)
{
    const std::size_t bytes = byteCount(shape);
    const std::uint64_t hash = bytes == 0 ? 0 : hashOf(shape.getUnscaledPoints(), bytes);
    const auto [begin, end] = m_contents.equal_range(hash);
    for (auto it = begin; it != end; ++it)
    {
        if (std::shared_ptr<HullContents> known = it->second.lock(); known && known->equals(shape))
            return known;
    }
    auto made = std::make_shared<HullContents>(shape);
    m_contents.emplace(hash, made);
    add(weightOf(*made));
    return made;
}

const Hull<btScalar>* HullCache::updateContents(HullRecord& record, const btConvexHullShape& shape,
                                                std::uint64_t pass) noexcept
try
{
    std::shared_ptr<HullContents> found;
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        found = record.current && record.current->equals(shape) ? record.current : contentsOf(shape);
    }
    const std::lock_guard<std::mutex> lock(m_mutex);
    if (record.current != found)
    {
        record.previous = std::move(record.current);
        record.current = found;
        record.hull.store(&found->cloud(), std::memory_order_release);
        record.scannedTotal.store(0, std::memory_order_relaxed);
        record.contents.store(found.get(), std::memory_order_release);
        record.revision.fetch_add(1, std::memory_order_release);
    }
    record.checkedPass.store(pass, std::memory_order_release);
    return record.hull.load(std::memory_order_acquire);
}
catch (const std::exception&)
{
    return nullptr;
}

/// The hull of a record without a graph: the points, or the graph once it is worth its cost. No result depends on it.
const Hull<btScalar>* HullCache::cloudOrGraph(HullRecord& record, const Hull<btScalar>& cloud) noexcept
{
    if (cloud.vertexCount() > kMostScanned && reachesBuildCost(record, cloud, 1))
    {
        if (const Hull<btScalar>* const graph = build(record))
            return graph;
    }
    return &cloud;
}

void HullCache::countContact(HullRecord& record) noexcept
{
    const Hull<btScalar>* const hull = record.hull.load(std::memory_order_acquire);
    if (hull != nullptr && hull->kind() == HullKind::Cloud &&
        reachesBuildCost(record, *hull, kScansOfContact))
        build(record);
}

/// True for the one scan with which the total cost of scans reaches that of the graph.
bool HullCache::reachesBuildCost(HullRecord& record, const Hull<btScalar>& cloud,
                                 std::uint32_t scans) noexcept
{
    if (!mayBuild(record, cloud))
        return false;
    const std::uint32_t before = record.scannedTotal.fetch_add(scans, std::memory_order_relaxed);
    const std::uint32_t enough =
        kLeastScans + static_cast<std::uint32_t>(hashOf(cloud.lanes(0), sizeof(btScalar) * 4)) % kScanSpread;
    return before <= enough && before + scans > enough;
}

/// Builds the graph of a record's contents.
const Hull<btScalar>* HullCache::build(HullRecord& record) noexcept
try
{
    std::shared_ptr<HullContents> contents;
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        contents = record.current;
    }
    // Without the lock, so that other shapes do not wait for the graph of a large hull.
    bool isFirst;
    const Hull<btScalar>& graph = contents->graph(isFirst);
    const std::lock_guard<std::mutex> lock(m_mutex);
    m_buildsTotal += isFirst ? 1 : 0;
    if (record.current == contents)
        record.hull.store(&graph, std::memory_order_release);
    return &graph;
}
catch (const std::exception&)
{
    return nullptr;
}

void HullCache::prepare(const btConvexHullShape& shape) noexcept
{
    HullRecord* const record = acquire(shape);
    if (record == nullptr)
        return;
    record->isPinned.store(true, std::memory_order_release);
    graphOf(*record, shape, 0);
    release(*record);
}

void HullCache::setDeforming(const btConvexHullShape& shape, bool isDeforming) noexcept
{
    HullRecord* const record = acquire(shape);
    if (record == nullptr)
        return;
    const std::lock_guard<std::mutex> lock(m_mutex);
    record->isDeforming.store(isDeforming, std::memory_order_release);
    forgetGraph(*record);
    release(*record);
}

/// Removes the graph of a record that may have none any more.
void HullCache::forgetGraph(HullRecord& record) noexcept
{
    if (record.current && !mayBuild(record, record.current->cloud()))
        record.hull.store(&record.current->cloud(), std::memory_order_release);
}

void HullCache::invalidate(const btConvexHullShape& shape) noexcept
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    const auto it = m_records.find(&shape);
    // The record is empty if its allocation failed.
    if (it == m_records.end() || !it->second)
        return;
    HullRecord& record = *it->second;
    record.isPinned.store(false, std::memory_order_release);
    record.isDeforming.store(false, std::memory_order_release);
    record.checkedPass.store(0, std::memory_order_release);
    forgetGraph(record);
    if (record.references.load(std::memory_order_acquire) == 0)
        m_records.erase(it);
}

void HullCache::trim() noexcept
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    sweep();
}

HullCacheStats HullCache::stats() const
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    HullCacheStats stats;
    stats.shapes = m_records.size();
    stats.pointSets = m_contents.size();
    for (const auto& entry : m_contents)
        stats.graphs += entry.second.expired() ? 0 : 1;
    stats.buildsTotal = m_buildsTotal;
    return stats;
}

void prepare(const btConvexHullShape& shape)
{
    HullCache::instance().prepare(shape);
}

void setDeforming(const btConvexHullShape& shape, bool isDeforming)
{
    HullCache::instance().setDeforming(shape, isDeforming);
}

void invalidate(const btConvexHullShape& shape)
{
    HullCache::instance().invalidate(shape);
}

void trimHullCache()
{
    HullCache::instance().trim();
}

HullCacheStats hullCacheStats()
{
    return HullCache::instance().stats();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
