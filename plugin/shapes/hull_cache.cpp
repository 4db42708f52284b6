// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/hull_cache.h"

#include "cullet/base/held_while_forking.h"
#include "cullet/narrow/build/cloud_builder.h"
#include "cullet/narrow/build/hull_builder.h"

#include <algorithm>
#include <cstring>
#include <new>

namespace cullet
{
template Hull<btScalar> makeHull(const std::vector<Eigen::Matrix<btScalar, 3, 1>>&, HullExtra);

inline namespace CULLET_PRECISION
{
namespace
{
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

void HullContents::assign(const btConvexHullShape& shape)
{
    m_pointCount = static_cast<std::size_t>(shape.getNumPoints());
    // Bullet returns no valid address for 0 points.
    const btScalar* const first = m_pointCount == 0 ? nullptr : shape.getUnscaledPoints()->m_floats;
    CloudBuilder<btScalar>::refill(m_cloud, first, shape.getNumPoints());
    m_points.clear();
    if (m_cloud.vertexCount() == 0 ||
        !areEqualBytes(m_cloud.lanes(0), first, m_pointCount * sizeof(btVector3)))
        m_points.assign(first, first + kScalarsPerPoint * m_pointCount);
    m_twin.reset();
}

std::uint64_t HullContents::hash() const noexcept
{
    return m_pointCount == 0 ? 0 : hashOf(points(), m_pointCount * sizeof(btVector3));
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
        left += isUsed ? kFixedWeight + (it->second ? ownWeightOf(*it->second) : 0) : 0;
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

std::size_t HullCache::ownWeightOf(const HullRecord& record)
{
    std::size_t weight = 0;
    for (const std::shared_ptr<HullContents>& contents : {record.current, record.previous})
        weight += contents && !contents->isShared() ? weightOf(*contents) : 0;
    return weight;
}

std::uint64_t HullCache::ownCountOf(const HullRecord& record)
{
    std::uint64_t count = 0;
    for (const std::shared_ptr<HullContents>& contents : {record.current, record.previous})
        count += contents && !contents->isShared() ? 1 : 0;
    return count;
}

/// Shared contents with these points, or null.
template <class Points>
std::shared_ptr<HullContents> HullCache::findShared(std::uint64_t hash, const Points& points) const
{
    const auto [begin, end] = m_contents.equal_range(hash);
    for (auto it = begin; it != end; ++it)
    {
        if (std::shared_ptr<HullContents> known = it->second.lock(); known && known->equals(points))
            return known;
    }
    return nullptr;
}

/// The contents of a shape that has not been edited since its record was made.
std::shared_ptr<HullContents> HullCache::firstContents(const btConvexHullShape& shape)
{
    auto made = std::make_shared<HullContents>();
    made->assign(shape);
    const std::uint64_t hash = made->hash();
    if (std::shared_ptr<HullContents> known = findShared(hash, *made))
        return known;
    m_contents.emplace(hash, made);
    made->share();
    add(weightOf(*made));
    return made;
}

/// The contents of a shape that was edited, in the memory of those before the last ones if only this record has had
/// them.
///
/// No thread reads those any more. They were replaced in the first use of the shape after the last edit but one; only
/// uses between these two edits could still compare them with the shape, and an edit during a use is a data race of the
/// application. The previous contents, which the same reasoning does not cover yet, become those that are kept.
std::shared_ptr<HullContents> HullCache::editedContents(HullRecord& record, const btConvexHullShape& shape)
{
    std::shared_ptr<HullContents> contents = std::move(record.previous);
    if (!contents || contents->isShared())
    {
        contents = std::make_shared<HullContents>();
        add(weightOf(*contents));
    }
    contents->assign(shape);
    return contents;
}

void HullCache::exchange(HullRecord& record, std::shared_ptr<HullContents> contents)
{
    record.previous = std::exchange(record.current, std::move(contents));
    record.hull.store(&record.current->cloud(), std::memory_order_release);
    record.scannedTotal.store(0, std::memory_order_relaxed);
    record.contents.store(record.current.get(), std::memory_order_release);
    record.revision.fetch_add(1, std::memory_order_release);
}

const Hull<btScalar>* HullCache::updateContents(HullRecord& record, const btConvexHullShape& shape,
                                                std::uint64_t pass) noexcept
try
{
    const std::lock_guard<std::mutex> lock(m_mutex);
    // Another thread may have exchanged them.
    if (!record.current || !record.current->equals(shape))
        exchange(record, record.current ? editedContents(record, shape) : firstContents(shape));
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

/// The contents that have the graph of some contents: shared ones with equal points, or these, which become shared.
std::shared_ptr<HullContents> HullCache::ownerOfGraph(const std::shared_ptr<HullContents>& contents)
{
    if (contents->isShared())
        return contents;
    if (!contents->twin())
    {
        const std::uint64_t hash = contents->hash();
        contents->setTwin(findShared(hash, *contents));
        if (!contents->twin())
        {
            m_contents.emplace(hash, contents);
            contents->share();
            return contents;
        }
    }
    return contents->twin();
}

/// Builds the graph of a record's contents.
const Hull<btScalar>* HullCache::build(HullRecord& record) noexcept
try
{
    std::shared_ptr<HullContents> contents, owner;
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        contents = record.current;
        owner = ownerOfGraph(contents);
    }
    // Without the lock, so that other shapes do not wait for the graph of a large hull.
    bool isFirst;
    const Hull<btScalar>& graph = owner->graph(isFirst);
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
    if (!record->isPinned.exchange(true, std::memory_order_acq_rel))
        record->revision.fetch_add(1, std::memory_order_release);
    graphOf(*record, shape, 0);
    release(*record);
}

void HullCache::setDeforming(const btConvexHullShape& shape, bool isDeforming) noexcept
{
    HullRecord* const record = acquire(shape);
    if (record == nullptr)
        return;
    const std::lock_guard<std::mutex> lock(m_mutex);
    if (record->isDeforming.exchange(isDeforming, std::memory_order_acq_rel) != isDeforming)
        record->revision.fetch_add(1, std::memory_order_release);
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
    record.revision.fetch_add(1, std::memory_order_release);
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
    for (const auto& entry : m_records)
        stats.graphs += entry.second ? ownCountOf(*entry.second) : 0;
    stats.pointSets = stats.graphs + m_contents.size();
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
