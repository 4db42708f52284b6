// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/plugin/core/equal_bytes.h"
#include "cullet/plugin/shapes/hull_preparation.h"

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
/// A copy of the points of a btConvexHullShape, and their hull graph once it is needed. The points are unscaled, so that
/// changes of scaling or margin have no effect.
///
/// Contents are shared: shapes with equal points have the same ones. Or they belong to one record, whose shape was
/// edited; its next contents but one can then be written into them.
class HullContents
{
public:
    HullContents() = default;
    HullContents(const HullContents&) = delete;
    HullContents& operator=(const HullContents&) = delete;

    /// Replaces the points. For as many points as before, or fewer, nothing is allocated.
    ///
    /// @pre not shared, and no thread reads these contents
    void assign(const btConvexHullShape& shape);

    /// Compares bit by bit. Cost: one pass over the points, a nanosecond for three to ten points.
    bool equals(const btConvexHullShape& shape) const noexcept
    {
        // Bullet returns no valid address for 0 points.
        return static_cast<std::size_t>(shape.getNumPoints()) == m_pointCount &&
               (m_pointCount == 0 ||
                areEqualBytes(points(), shape.getUnscaledPoints(), m_pointCount * sizeof(btVector3)));
    }
    bool equals(const HullContents& other) const noexcept
    {
        return m_pointCount == other.m_pointCount &&
               (m_pointCount == 0 ||
                areEqualBytes(points(), other.points(), m_pointCount * sizeof(btVector3)));
    }
    std::uint64_t hash() const noexcept;
    /// The points without a graph, for support searches.
    const Hull<btScalar>& cloud() const noexcept { return m_cloud; }
    std::size_t pointCount() const noexcept { return m_pointCount; }
    /// The graph. The first call builds it; concurrent calls wait for it.
    ///
    /// @param isFirst [out] true if this call has built it
    const Hull<btScalar>& graph(bool& isFirst);

    bool isShared() const noexcept { return m_isShared; }
    /// From now on other records may use these contents, which do not change any more.
    void share() noexcept { m_isShared = true; }
    /// Shared contents with equal points that have the graph; null: these contents have it.
    const std::shared_ptr<HullContents>& twin() const noexcept { return m_twin; }
    void setTwin(std::shared_ptr<HullContents> twin) noexcept { m_twin = std::move(twin); }

private:
    static constexpr std::size_t kScalarsPerPoint = sizeof(btVector3) / sizeof(btScalar);

    /// The points as in the shape, including the unused fourth component.
    const btScalar* points() const noexcept { return m_points.empty() ? m_cloud.lanes(0) : m_points.data(); }
    std::vector<Eigen::Matrix<btScalar, 3, 1>> xyzPoints() const;

    std::size_t m_pointCount = 0;
    Hull<btScalar> m_cloud;
    std::vector<btScalar> m_points;  ///< empty if the cloud's lanes have the same bits
    std::once_flag m_isBuilt;
    Hull<btScalar> m_graph;
    bool m_isShared = false;
    std::shared_ptr<HullContents> m_twin;
};

/// The cached data of the shape at one address.
struct HullRecord
{
    const btConvexHullShape* shape = nullptr;  ///< for comparing the address; the shape may be destroyed
    std::atomic<const HullContents*> contents{nullptr};
    std::atomic<const Hull<btScalar>*> hull{nullptr};  ///< cloud or graph of the contents
    std::atomic<std::uint64_t> checkedPass{0};  ///< pass of the last comparison between shape and contents
    std::atomic<std::int32_t> references{0};
    std::atomic<std::uint32_t> revision{0};      ///< changed with all that contacts depend on
    std::atomic<std::uint32_t> scannedTotal{0};  ///< scans of these contents without a graph
    std::atomic<bool> isPinned{false};           ///< prepare()
    std::atomic<bool> isDeforming{false};        ///< setDeforming()
    /// The current contents, and the previous ones, which another thread may still be comparing with the edited shape.
    std::shared_ptr<HullContents> current, previous;
};

/// Hull graphs of Bullet's hull shapes, shared by all pairs and worlds of the process.
///
/// There are two levels: a record per shape address, reference-counted by the pairs that use it, and the contents. A
/// record is valid only after the shape's points have been compared with its contents; so a shape that was edited in
/// place, or another one at a reused address, is never confused with the old one. The first contents of a record are
/// found by a hash of the points. Those of an edited shape are its own until it needs a graph, and an edit later but
/// one is written into their memory: for a shape whose points are rewritten in every step nothing is hashed or
/// allocated. Records that no pair uses are kept until as much has been added as was in use before, and at least
/// kLeastAdded, since pairs change more often than shapes. So the cache keeps at most about 100 MB, or twice what was
/// in use at one time. It does not use Bullet's user pointers and indices.
///
/// Most pairs are proved separated by support searches over the points alone, and most contacts are found from the
/// points alone. So a graph is built when scans and contacts have cost as much as it does, or when a contact needs it:
/// where the faces around it are level up to rounding, or the closest features are not unique. A hull whose points
/// change often costs O(n) each time. No result depends on whether the graph exists.
///
/// A hull of more than kMostBuilt points gets a graph by prepare() only, since the construction may take longer than a
/// step. Without a graph its contacts are single points, as Bullet's. The same holds for a shape with setDeforming()
/// whose faces are level.
///
/// Threads: all members may run concurrently with each other. Editing a shape while a thread uses it is a data race,
/// as in Bullet itself.
/// Errors: no exceptions; without memory there is no graph, and Bullet's own algorithm handles the pair.
class HullCache
{
public:
    /// Largest number of points for which a graph is built without prepare(): about 10 ms.
    static constexpr std::int32_t kMostBuilt = 4096;

    /// Largest number of points for which a scan costs no more than hill climbing.
    static constexpr std::int32_t kMostScanned = 64;
    /// Number of scans that cost as much as the graph; a step has one, if every shape is compared once per step. The
    /// spread prevents that shapes which were created together get their graphs in the same step.
    static constexpr std::uint32_t kLeastScans = 1000, kScanSpread = 256;
    /// Cost of a contact of a hull without a graph, in scans.
    static constexpr std::uint32_t kScansOfContact = 64;

    /// Never destroyed: algorithms of worlds with static storage may outlive any other static object.
    static HullCache& instance();

    /// Adds a reference to the shape's record; null if out of memory.
    HullRecord* acquire(const btConvexHullShape& shape) noexcept;
    static void release(HullRecord& record) noexcept
    {
        record.references.fetch_sub(1, std::memory_order_release);
    }

    /// The hull of the shape's current points, or the points as a HullKind::Cloud; null if out of memory.
    ///
    /// @param pass not 0: shapes do not change as long as this number is used, so that one comparison suffices
    [[gnu::always_inline]] static const Hull<btScalar>* hullOf(HullRecord& record,
                                                               const btConvexHullShape& shape,
                                                               std::uint64_t pass) noexcept
    {
        if (pass != 0 && record.checkedPass.load(std::memory_order_acquire) == pass)
            return record.hull.load(std::memory_order_acquire);
        const HullContents* contents = record.contents.load(std::memory_order_acquire);
        if (contents == nullptr || !contents->equals(shape))
            return instance().updateContents(record, shape, pass);
        record.checkedPass.store(pass, std::memory_order_release);
        const Hull<btScalar>* hull = record.hull.load(std::memory_order_acquire);
        return hull->kind() == HullKind::Cloud ? instance().cloudOrGraph(record, *hull) : hull;
    }

    /// The graph of the shape's current points; a HullKind::Cloud only if mayBuild() is false; null if out of memory.
    static const Hull<btScalar>* graphOf(HullRecord& record, const btConvexHullShape& shape,
                                         std::uint64_t pass) noexcept
    {
        const Hull<btScalar>* hull = hullOf(record, shape, pass);
        return hull != nullptr && hull->kind() == HullKind::Cloud && mayBuild(record, *hull)
                   ? instance().build(record)
                   : hull;
    }

    /// Whether a record without a graph may get one.
    static bool mayBuild(const HullRecord& record, const Hull<btScalar>& cloud)
    {
        return !record.isDeforming.load(std::memory_order_acquire) &&
               (cloud.vertexCount() <= kMostBuilt || record.isPinned.load(std::memory_order_acquire));
    }

    /// Counts a contact of a record without a graph, and builds the graph when contacts have cost as much.
    void countContact(HullRecord& record) noexcept;

    void prepare(const btConvexHullShape& shape) noexcept;
    void setDeforming(const btConvexHullShape& shape, bool isDeforming) noexcept;
    void invalidate(const btConvexHullShape& shape) noexcept;
    /// Removes all that no pair uses and that was not prepared.
    void trim() noexcept;
    HullCacheStats stats() const;

private:
    /// Size of a record, or of contents without their points, in units of a graph's point: 450 bytes each.
    static constexpr std::size_t kFixedWeight = 32;
    static std::size_t weightOf(const HullContents& contents) { return kFixedWeight + contents.pointCount(); }
    /// The contents that belong to a record alone.
    static std::size_t ownWeightOf(const HullRecord& record);
    static std::uint64_t ownCountOf(const HullRecord& record);
    static constexpr std::size_t kLeastAdded = std::size_t(1) << 18;

    HullCache() = default;

    static void forgetGraph(HullRecord& record) noexcept;
    const Hull<btScalar>* build(HullRecord& record) noexcept;
    static bool reachesBuildCost(HullRecord& record, const Hull<btScalar>& cloud,
                                 std::uint32_t scans) noexcept;
    const Hull<btScalar>* cloudOrGraph(HullRecord& record, const Hull<btScalar>& cloud) noexcept;
    const Hull<btScalar>* updateContents(HullRecord& record, const btConvexHullShape& shape,
                                         std::uint64_t pass) noexcept;
    void exchange(HullRecord& record, std::shared_ptr<HullContents> contents);
    template <class Points>
    std::shared_ptr<HullContents> findShared(std::uint64_t hash, const Points& points) const;
    std::shared_ptr<HullContents> firstContents(const btConvexHullShape& shape);
    std::shared_ptr<HullContents> editedContents(HullRecord& record, const btConvexHullShape& shape);
    std::shared_ptr<HullContents> ownerOfGraph(const std::shared_ptr<HullContents>& contents);
    void add(std::size_t weight) noexcept;
    void sweep() noexcept;

    mutable std::mutex m_mutex;
    std::unordered_map<const btConvexHullShape*, std::unique_ptr<HullRecord>> m_records;
    std::unordered_multimap<std::uint64_t, std::weak_ptr<HullContents>>
        m_contents;                 ///< the shared ones, by hash
    std::size_t m_addedWeight = 0;  ///< total weight since the last sweep
    std::size_t m_sweepAt = kLeastAdded;
    std::atomic<std::uint64_t> m_buildsTotal{0};
};

/// A pair's reference to the record of one of its shapes. Holds no copies; empty until the first hullOf().
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

    /// See HullCache::mayBuild(), for the shape of the last call.
    bool mayBuild(const Hull<btScalar>& cloud) const
    {
        return m_record != nullptr && HullCache::mayBuild(*m_record, cloud);
    }

    /// See HullCache::countContact(), for the shape of the last call.
    void countContact() noexcept
    {
        if (m_record != nullptr)
            HullCache::instance().countContact(*m_record);
    }

    /// Two results of hullOf() for one shape are the same hull only if their revisions are equal: addresses are reused.
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
    /// @return false if out of memory
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
