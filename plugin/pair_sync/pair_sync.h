// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/queries/query_index.h"
#include "cullet/broad/row_source.h"
#include "cullet/plugin/core/broadphase_options.h"
#include "cullet/plugin/pair_sync/allowed_pairs.h"
#include "cullet/plugin/pair_sync/coarse_boxes.h"
#include "cullet/plugin/pair_sync/deferred_pairs.h"
#include "cullet/plugin/pair_sync/pair_cache_adapter.h"
#include "cullet/plugin/pair_sync/pair_map.h"
#include "cullet/plugin/pair_sync/quiet_boxes.h"
#include "cullet/plugin/pair_sync/sync_state.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Synchronises the pair cache with the boxes: runs the backend and applies its delta, in the order of unique ids.
///
/// The backend holds the pairs of the cache, without the speculative ones (pairs of ghosts, added immediately), plus
/// the deferred ones (see DeferredPairs). Callbacks of the application run while changes are applied and may do
/// anything to proxies: the table's changes are consumed before, and every proxy is looked up by its id when its pair
/// is applied.
///
/// cullet's cache counts the changes by the application; in other caches PairSync detects them by the number of pairs.
/// The backend then restarts from the pairs of the cache: pairs that the application added are removed when their boxes
/// separate; a pair that is new although neither box changed was removed by the application, and becomes deferred.
class PairSync
{
public:
    PairSync(ProxyStore& store, btOverlappingPairCache* cache, std::unique_ptr<Backend> backend,
             const BroadphaseOptions& options);

    PairCacheAdapter& adapter() noexcept { return m_adapter; }
    const PairCacheAdapter& adapter() const noexcept { return m_adapter; }
    const Backend& backend() const noexcept { return *m_backend; }
    void setBackend(std::unique_ptr<Backend> backend);

    /// Finds and applies all changes. A nested call, from a callback, does nothing.
    ///
    /// @param index of the table, for pairs that the filter refused
    void update(float margin, const QueryIndex& index, btDispatcher* dispatcher);

    /// Called with the pairs that an update removes from the cache, before it does. Some may not be there.
    void observeRemovals(std::function<void(const Pairs&)> observer) { m_onRemovals = std::move(observer); }

    /// Adds the pair of a ghost immediately, if the exact boxes overlap and the filter agrees.
    void addImmediately(Proxy& a, Proxy& b);

    /// Whether the exact boxes overlap and the cache has the pair.
    bool hasOverlap(Proxy& a, Proxy& b) const { return overlapNow(a, b) && m_adapter.contains(a, b); }

    /// Removes all pairs of a proxy that has not been destroyed yet.
    void removePairsOf(Proxy& proxy, btDispatcher* dispatcher);

    /// Frees the rows of destroyed proxies without an update; the next update restarts the backend from all rows.
    void skipChanges();

    /// The backend as a RowSource that knows where all rows are now; null if there is none.
    const RowSource* rowSource() const
    {
        const bool knowsRows = !m_state.needsRestart() && m_allowedPairs == nullptr &&
                               !m_store.table().hasChanges() && !m_quietBoxes.isQuiet();
        return knowsRows ? m_rowSource : nullptr;
    }
    std::uint64_t updatesTotal() const noexcept { return m_updatesTotal; }

    void addTo(BroadphaseStats& stats) const;

private:
    void useBackend(std::unique_ptr<Backend> backend);
    void detectExternalChanges();
    bool runBackend(const ProxyView& view, bool needsRestart);
    void replaceBackend(Status status);
    void restartBackend();
    void deferExternallyRemoved(const ProxyView& view);
    void collectToReevaluate(const ProxyView& view, bool mustReevaluateAll);
    void deferSeparated(float margin);
    void applyRemoved(float margin, btDispatcher* dispatcher);
    void removeFromCache(const Pairs& pairs, btDispatcher* dispatcher);
    void applyAdded(float margin);
    void addInOrder(const Pairs& pairs, float margin);
    void updateByBackend(float margin, const QueryIndex& index, btDispatcher* dispatcher);
    bool hasPairsToApply() const;
    bool hasOnlyHeldPairs() const;
    bool isQuiet(float margin);
    void measureRooms(float margin);
    void applyChanges(const ProxyView& view, const SyncState& before, bool hasCoarseChanges,
                      const QueryIndex& index, btDispatcher* dispatcher);
    void trimMemory();
    void askAgain(const QueryIndex& index, float margin);
    void askAgainOf(Proxy& proxy, const QueryIndex& index, float margin);
    void askAgainAbout(Pair pair, Proxy& first, Proxy& second, float margin);
    bool areNearInTable(const Proxy& first, const Proxy& second, float margin) const;
    bool passesFilterNow(Proxy& first, Proxy& second) const;
    bool mayBeginAllowedPairs() const;
    void beginAllowedPairs(float margin);
    bool updateAllowedPairs(const ProxyView& view);
    bool overlapInTable(const Proxy& first, const Proxy& second) const;
    void askAllowedOf(Proxy& proxy, bool isFirst);
    [[gnu::always_inline]] void prefetchAddition(const Pair* coming, std::size_t count,
                                                 bool readsTable) const;
    void addUnfiltered(Pair pair, float margin, bool isNew);
    void addNew(const Pairs& pairs, float margin);
    bool areFewWith(std::size_t more) const;
    void addWithCallbacks(const Pairs& pairs, bool areAbsent, float margin);
    void reserveExpected(std::size_t passed, std::size_t asked, std::size_t remaining);
    bool tryAdd(Pair pair, bool isAbsent, float margin);
    void defer(Pair pair, const Proxy& first, const Proxy& second, bool exactBoxesOverlap, float margin);
    void deferNear(Pair pair, const Proxy& first, const Proxy& second, float margin);
    void markRefused();
    bool isExternallyRemoved(Pair pair, const ProxyView& view) const;
    bool haveValidBoxes(const Proxy& first, const Proxy& second) const;
    bool overlapNow(const Proxy& first, const Proxy& second) const;
    bool areSeparated(Pair pair, float margin) const;

    /// One row in so many overlaps a proxy: many, for a tree.
    static constexpr std::size_t kManyPartnersShare = 32;

    const BroadphaseOptions m_options;
    ProxyStore& m_store;
    PairCacheAdapter m_adapter;
    CoarseBoxes m_coarseBoxes;
    std::unique_ptr<Backend> m_backend;
    const RowSource* m_rowSource = nullptr;        // the backend, if it is one
    std::unique_ptr<AllowedPairs> m_allowedPairs;  // not null: in the place of the backend, which has no rows
    DeferredPairs m_deferredPairs;
    PairMap m_speculativePairs;
    QuietBoxes m_quietBoxes;
    std::function<void(const Pairs&)> m_onRemovals;
    bool m_isGrid = false;  ///< the backend is cullet's grid, which nobody expects to see each update

    PairDelta m_delta;
    Pairs m_toReevaluate;                   // deferred pairs to re-evaluate
    std::vector<std::uint32_t> m_due;       // ids of proxies whose refused pairs are to be re-evaluated
    std::vector<std::uint32_t> m_partners;  // ids near one of them
    Pairs m_separatedPairs;                 // of the cache, whose coarse boxes the backend finds overlapping
    Pairs m_scratch;

    const btOverlapFilterCallback* m_filter = nullptr;  // filter callback at the last update
    std::uint64_t m_refusedNow = 0;                     // pairs that the filter refused in this update
    int m_expectedCount = 0;                            // pairs in the cache if only PairSync has changed it
    std::uint64_t m_externalChanges = 0;                // the adapter's count at the last update
    SyncState m_state;
    bool m_hadChanges = false;  // whether the last update had pairs to apply, so that the lists may be large
    std::uint64_t m_updatesTotal = 0;
    std::uint64_t m_restartsTotal = 0;
    std::uint64_t m_fallbacksTotal = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
