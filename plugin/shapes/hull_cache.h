// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/plugin/core/equal_bytes.h"
#include "cullet/plugin/isa_gjk.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A copy of the points of a btConvexHullShape, and their hull graph once it is wanted. Shapes with equal points share one.
/// Unscaled: a change of scaling or margin needs nothing.
class HullContents
{
public:
    explicit HullContents(const btConvexHullShape& shape);

    /// Bit by bit. Cost: one pass over the points, a nanosecond for three to ten points.
    bool equals(const btConvexHullShape& shape) const noexcept
    {
        const auto count = static_cast<std::size_t>(shape.getNumPoints());
        if (count == 0)
            return m_points.empty();  // Bullet has no address for no points
        return count * kScalarsPerPoint == m_points.size() &&
               areEqualBytes(m_points.data(), shape.getUnscaledPoints(), count * sizeof(btVector3));
    }
    /// The points alone, for support searches.
    const Hull<btScalar>& cloud() const noexcept { return m_cloud; }
    std::size_t pointCount() const noexcept { return m_points.size() / kScalarsPerPoint; }
    /// The graph, built by the first call, however many threads make it.
    ///
    /// @param isFirst [out] true if this call has built it
    const Hull<btScalar>& graph(bool& isFirst);

private:
    static constexpr std::size_t kScalarsPerPoint = sizeof(btVector3) / sizeof(btScalar);

    std::vector<Eigen::Matrix<btScalar, 3, 1>> threeOfEach() const;

    std::vector<btScalar> m_points;  ///< as in the shape, the unused fourth component included
    Hull<btScalar> m_cloud;
    std::once_flag m_isBuilt;
    Hull<btScalar> m_graph;
};

/// What is known of the shape at one address.
struct HullRecord
{
    const btConvexHullShape* shape = nullptr;  ///< the address only: the shape may be gone
    std::atomic<const HullContents*> contents{nullptr};
    std::atomic<const Hull<btScalar>*> hull{nullptr};  ///< cloud or graph of the contents
    std::atomic<std::uint64_t> checkedIn{0};  ///< the pass in which shape and contents were compared last
    std::atomic<std::int32_t> references{0};
    std::atomic<std::uint32_t> revision{0};      ///< changes with the contents
    std::atomic<std::uint32_t> scannedTotal{0};  ///< comparisons with these contents while there was no graph
    std::atomic<bool> isPinned{false};           ///< prepare()
    std::atomic<bool> isDeforming{false};        ///< setDeforming()
    /// Those in use, and the ones before, which another thread may still be comparing with.
    std::shared_ptr<HullContents> current, previous;
};

/// Hull graphs of Bullet's hull shapes, shared by every pair and every world of the process.
///
/// Two levels: a record per shape address, counted by the pairs that use it, and behind it the contents, found by a hash
/// of the points. A record says nothing until the shape's points have been compared with its contents; so a shape that
/// was edited in place, or another one at a reused address, is never taken for the old one. Records that no pair uses
/// stay for a while, since pairs come and go while shapes stay: until as much has been added as was in use before, and at least
/// kLeastAdded. So no more is kept than some 100 MB, or twice of what was in use at one time. Bullet's user pointers and indices
/// are left alone.
///
/// Most pairs stay apart, which support searches over the points alone prove, and most contacts can be found from the points
/// alone. So a graph is built when scans and contacts have cost as much as it does, or when a contact needs it: where the faces
/// around it are level up to rounding, or no feature is the only one. A hull whose points change often costs O(n) each time. No
/// answer depends on whether the graph is there.
///
/// A hull of more than kMostBuilt points gets a graph by prepare() only, since that takes longer than a step may: without, its
/// contacts are single points, as Bullet's. So are those of a shape with setDeforming() whose faces are level.
///
/// Threads: every member may run concurrently with every other. Editing a shape while a thread uses it is a data race in
/// Bullet itself and here.
/// Errors: none leaves; without memory there is no graph, and the pair goes to Bullet's own algorithm.
class HullCache
{
public:
    /// Points of a hull that gets a graph unprepared: some 10 ms.
    static constexpr std::int32_t kMostBuilt = 4096;

    /// Points up to which a scan costs no more than a climb.
    static constexpr std::int32_t kMostScanned = 64;
    /// Scans that cost as much as the graph; steps, where every shape is compared once a step. Two numbers, so that shapes that came
    /// together do not get their graphs together.
    static constexpr std::uint32_t kLeastScans = 1000, kScanSpread = 256;
    /// What the contact of a hull without a graph costs.
    static constexpr std::uint32_t kScansOfContact = 64;

    /// Never destroyed: algorithms of worlds with static storage may outlive any other static object.
    static HullCache& instance();

    /// Counts one more user of the shape's record; null without memory.
    HullRecord* acquire(const btConvexHullShape& shape) noexcept;
    static void release(HullRecord& record) noexcept
    {
        record.references.fetch_sub(1, std::memory_order_release);
    }

    /// The hull of the points that the shape has now, or the points as a HullKind::Cloud; null without memory.
    ///
    /// @param pass not 0: shapes asked for with this number do not change while it is in use, and one comparison is enough
    [[gnu::always_inline]] static const Hull<btScalar>* hullOf(HullRecord& record,
                                                               const btConvexHullShape& shape,
                                                               std::uint64_t pass) noexcept
    {
        if (pass != 0 && record.checkedIn.load(std::memory_order_acquire) == pass)
            return record.hull.load(std::memory_order_acquire);
        const HullContents* contents = record.contents.load(std::memory_order_acquire);
        if (contents == nullptr || !contents->equals(shape))
            return instance().replace(record, shape, pass);
        record.checkedIn.store(pass, std::memory_order_release);
        const Hull<btScalar>* hull = record.hull.load(std::memory_order_acquire);
        return hull->kind() == HullKind::Cloud ? instance().scanned(record, *hull) : hull;
    }

    /// The same for contacts: a graph, except of very many points that were not prepared.
    static const Hull<btScalar>* graphOf(HullRecord& record, const btConvexHullShape& shape,
                                         std::uint64_t pass) noexcept
    {
        const Hull<btScalar>* hull = hullOf(record, shape, pass);
        return hull != nullptr && hull->kind() == HullKind::Cloud && mayBuild(record, *hull)
                   ? instance().build(record)
                   : hull;
    }

    /// Of a record that may have no graph yet, which it gets when contacts have cost as much.
    void countContact(HullRecord& record) noexcept;

    void prepare(const btConvexHullShape& shape) noexcept;
    void setDeforming(const btConvexHullShape& shape, bool isDeforming) noexcept;
    void invalidate(const btConvexHullShape& shape) noexcept;
    /// Drops what no pair uses and nobody has prepared.
    void trim() noexcept;
    HullCacheStats stats() const;

private:
    /// What a record, or contents beside their points, take in points of a graph: 450 bytes each.
    static constexpr std::size_t kFixedWeight = 32;
    static std::size_t weightOf(const HullContents& contents) { return kFixedWeight + contents.pointCount(); }
    static constexpr std::size_t kLeastAdded = std::size_t(1) << 18;

    HullCache() = default;

    static bool mayBuild(const HullRecord& record, const Hull<btScalar>& cloud)
    {
        return !record.isDeforming.load(std::memory_order_acquire) &&
               (cloud.vertexCount() <= kMostBuilt || record.isPinned.load(std::memory_order_acquire));
    }
    static void forgetGraph(HullRecord& record) noexcept;
    const Hull<btScalar>* build(HullRecord& record) noexcept;
    static bool pays(HullRecord& record, const Hull<btScalar>& cloud, std::uint32_t scans) noexcept;
    const Hull<btScalar>* scanned(HullRecord& record, const Hull<btScalar>& cloud) noexcept;
    const Hull<btScalar>* replace(HullRecord& record, const btConvexHullShape& shape,
                                  std::uint64_t pass) noexcept;
    std::shared_ptr<HullContents> contentsOf(const btConvexHullShape& shape);
    void add(std::size_t weight) noexcept;
    void sweep() noexcept;

    mutable std::mutex m_mutex;
    std::unordered_map<const btConvexHullShape*, std::unique_ptr<HullRecord>> m_records;
    std::unordered_multimap<std::uint64_t, std::weak_ptr<HullContents>> m_contents;
    std::size_t m_added = 0;  ///< weight, since the last sweep
    std::size_t m_sweepAt = kLeastAdded;
    std::atomic<std::uint64_t> m_buildsTotal{0};
};

/// One side of a pair: its use of a record. Copies of nothing; null until the first hullOf().
class HullUse
{
public:
    HullUse() = default;
    ~HullUse() { reset(); }
    HullUse(const HullUse&) = delete;
    HullUse& operator=(const HullUse&) = delete;
    HullUse(HullUse&& other) noexcept : m_record(std::exchange(other.m_record, nullptr)) {}

    /// See HullCache::hullOf().
    [[gnu::always_inline]] const Hull<btScalar>* hullOf(const btConvexHullShape& shape,
                                                        std::uint64_t pass) noexcept
    {
        return uses(shape) ? HullCache::hullOf(*m_record, shape, pass) : nullptr;
    }

    /// See HullCache::graphOf().
    const Hull<btScalar>* graphOf(const btConvexHullShape& shape, std::uint64_t pass) noexcept
    {
        return uses(shape) ? HullCache::graphOf(*m_record, shape, pass) : nullptr;
    }

    /// Of the shape of the last call; see HullCache::countContact().
    void countContact() noexcept
    {
        if (m_record != nullptr)
            HullCache::instance().countContact(*m_record);
    }

    /// Two hulls that hullOf() gave for one shape are the same if this is: addresses are used again.
    std::uint32_t revision() const noexcept
    {
        return m_record == nullptr ? 0 : m_record->revision.load(std::memory_order_acquire);
    }

    void reset() noexcept
    {
        if (m_record != nullptr)
            HullCache::release(*m_record);
        m_record = nullptr;
    }

private:
    /// @return false without memory
    [[gnu::always_inline]] bool uses(const btConvexHullShape& shape) noexcept
    {
        if (m_record == nullptr || m_record->shape != &shape)
        {
            reset();
            m_record = HullCache::instance().acquire(shape);
        }
        return m_record != nullptr;
    }

    HullRecord* m_record = nullptr;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
