// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/pair_sync/deferred_pairs.h"
#include "cullet/plugin/pair_sync/pair_cache_adapter.h"
#include "cullet/plugin/pair_sync/pair_map.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Keeps the pair cache in step with the boxes: runs the backend and applies what changed, in the order of unique ids.
///
/// The pairs of the backend are those of the cache, without the provisional ones (pairs of ghosts, added at once), and
/// the pending ones (see DeferredPairs). Callbacks of the application run while changes are applied and may do anything
/// to proxies: the table's changes are taken in before, and every proxy is looked up by its id when its turn comes.
///
/// That the application has added pairs to the cache or taken some out is told by cullet's cache, and noticed in others by the
/// number of pairs. The backend then begins anew from the pairs of the cache: added pairs are removed when their boxes are
/// apart, and what is new although neither box has changed was taken out, and becomes pending.
class PairSync
{
public:
    PairSync(ProxyStore& store, btOverlappingPairCache* cache, std::unique_ptr<Backend> backend,
             const BroadphaseOptions& options);

    PairCacheAdapter& adapter() noexcept { return m_adapter; }
    const PairCacheAdapter& adapter() const noexcept { return m_adapter; }
    const Backend& backend() const noexcept { return *m_backend; }
    void setBackend(std::unique_ptr<Backend> backend);

    /// Finds and applies all changes. Nothing happens in a nested call, from a callback.
    void update(float margin, btDispatcher* dispatcher);

    /// Adds the pair of a ghost now, if the exact boxes overlap and the filter agrees.
    void addAtOnce(Proxy& a, Proxy& b);

    /// Removes all pairs of a proxy, which is still intact.
    void removePairsOf(Proxy& proxy, btDispatcher* dispatcher);

    /// Frees the rows of destroyed proxies without an update; the next update sees every row as changed.
    void skipChanges();

    void addTo(BroadphaseStats& stats) const;

private:
    void noticeForeignChanges();
    bool runBackend(const ProxyView& view);
    void replaceBackend(Status status);
    void restartBackend();
    void holdBackTakenOut(const ProxyView& view);
    void collectDue(const ProxyView& view, bool areAllDue);
    void collectApart(const ProxyView& view, bool areAllDue);
    void holdApart(float margin);
    void applyRemoved(float margin, btDispatcher* dispatcher);
    void applyAdded(float margin);
    void addAtOneGo(float margin);
    void tryAdd(Pair pair, float margin);
    void hold(Pair pair, const Proxy& first, const Proxy& second, bool isExact, float margin);
    bool isTakenOut(Pair pair, const ProxyView& view) const;
    bool haveBoxes(const Proxy& first, const Proxy& second) const;
    bool overlapNow(const Proxy& first, const Proxy& second) const;
    bool areApart(Pair pair, float margin) const;

    const BroadphaseOptions m_options;
    ProxyStore& m_store;
    PairCacheAdapter m_adapter;
    std::unique_ptr<Backend> m_backend;
    DeferredPairs m_pending;
    PairMap m_provisional;

    PairDelta m_delta;
    Pairs m_due;    // pending pairs to look at again
    Pairs m_apart;  // pairs of the cache that the backend holds although their exact boxes are apart
    Pairs m_scratch;
    std::vector<ProxyPair> m_batch;

    const btOverlapFilterCallback* m_filter = nullptr;  // as of the last update
    int m_expectedCount = 0;             // pairs in the cache unless the application changed it
    std::uint64_t m_foreignChanges = 0;  // those that are known
    bool m_isRestartDue = false;
    bool m_isAllDue = false;
    bool m_isCacheChanged = false;  // nothing but that makes the restart due
    bool m_isUpdating = false;
    bool m_wasInterrupted = false;  // a callback of this update skipped changes or set another backend
    std::uint64_t m_updatesTotal = 0;
    std::uint64_t m_restartsTotal = 0;
    std::uint64_t m_fallbacksTotal = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
