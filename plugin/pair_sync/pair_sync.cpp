// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/pair_sync.h"

#include "cullet/base/trim_capacity.h"
#include "cullet/broad/log.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/pair_sync/backend_choice.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <string>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
void sortUnique(Pairs& pairs)
{
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}
}  // namespace

PairSync::PairSync(ProxyStore& store, btOverlappingPairCache* cache, std::unique_ptr<Backend> backend,
                   const BroadphaseOptions& options)
    : m_options(options), m_store(store), m_adapter(cache), m_coarseBoxes(store)
{
    useBackend(std::move(backend));
}

void PairSync::useBackend(std::unique_ptr<Backend> backend)
{
    m_backend = std::move(backend);
    m_rowSource = dynamicCast<const RowSource>(m_backend.get());
    m_isGrid = std::strcmp(m_backend->name(), "grid") == 0;
}

void PairSync::setBackend(std::unique_ptr<Backend> backend)
{
    useBackend(std::move(backend));
    m_state.restart();
}

void PairSync::update(float margin, const QueryIndex& index, btDispatcher* dispatcher)
{
    if (m_state.isUpdating())
        return;
    ++m_updatesTotal;
    if (!m_adapter.storesPairs())
        return skipChanges();
    detectExternalChanges();
    if (m_filter == nullptr)
        m_store.refreshSomeFilters();
    if (isQuiet(margin))
        return;
    m_quietBoxes.release(m_store.table(), m_state.needsRestart());
    updateByBackend(margin, index, dispatcher);
    if (!m_hadChanges && hasOnlyHeldPairs() && m_quietBoxes.isWorthMeasuring(m_store.table().size()))
        measureRooms(margin);
}

void PairSync::updateByBackend(float margin, const QueryIndex& index, btDispatcher* dispatcher)
{
    ProxyView view = m_store.table().beginUpdate(margin, m_filter == nullptr);
    const bool hasCoarseChanges = CoarseBoxes::haveChanged(view);
    if (hasCoarseChanges && m_coarseBoxes.tryRecentre(m_updatesTotal))
    {
        // Deferred pairs have boxes of the former origin.
        m_state.reevaluate();
        view = m_store.table().beginUpdate(margin, m_filter == nullptr);
    }
    // The backend then reports the refused pairs that are not listed.
    if (m_state.mustReevaluateAll() && (m_deferredPairs.hasMarkedRows() || m_allowedPairs != nullptr))
        m_state.restart();
    m_due.clear();
    m_refusedNow = 0;
    const SyncState before = m_state;
    SyncState::Update update(m_state);
    if (!runBackend(view, before.needsRestart()))
        return;
    update.consumeChanges();
    const bool hasChanges = hasPairsToApply() || hasCoarseChanges || before.mustReevaluateAll();
    if (hasChanges)
        applyChanges(view, before, hasCoarseChanges, index, dispatcher);
    else
        m_store.endUpdate();
    m_expectedCount = m_adapter.count();
    // New pairs of the backend that takes over are refused ones, as after a change of the cache.
    update.end(m_allowedPairs != nullptr && !m_allowedPairs->isStillCrowd());
    m_adapter.setLinked(m_allowedPairs == nullptr);
    if (hasChanges || m_hadChanges)
        trimMemory();
    m_hadChanges = hasChanges;
}

/// Whether pairs change, or may change. Often none do, and to ask each step would show in worlds of a few bodies.
bool PairSync::hasPairsToApply() const
{
    return !m_delta.added.empty() || !m_delta.removed.empty() || m_deferredPairs.mayHavePairs() ||
           m_speculativePairs.size() != 0 || m_allowedPairs != nullptr;
}

/// Applies the delta and re-evaluates deferred pairs. The callbacks of the application run here.
void PairSync::applyChanges(const ProxyView& view, const SyncState& before, bool hasCoarseChanges,
                            const QueryIndex& index, btDispatcher* dispatcher)
{
    const float margin = view.margin;
    if (before.isCacheChanged())
        deferExternallyRemoved(view);
    collectToReevaluate(view, before.mustReevaluateAll());
    m_separatedPairs.clear();
    if (hasCoarseChanges || (sizeof(btScalar) != sizeof(float) && before.mustReevaluateAll()))
        m_coarseBoxes.collectSeparated(*m_adapter.cache(), view.margin, m_separatedPairs);
    sortUnique(m_separatedPairs);
    m_store.endUpdate();
    applyRemoved(margin, dispatcher);
    askAgain(index, margin);
    const std::uint64_t withoutMemory = m_adapter.pairsWithoutMemory();
    applyAdded(margin);
    if (m_adapter.pairsWithoutMemory() != withoutMemory)
        log(LogLevel::Warning, "out of memory: the pair cache lacks pairs until the next update");
    if (mayBeginAllowedPairs())
        beginAllowedPairs(margin);
}

/// Frees what a rare large update needed.
void PairSync::trimMemory()
{
    trimCapacity(m_delta.added);
    trimCapacity(m_delta.removed);
    trimCapacity(m_toReevaluate);
    trimCapacity(m_due);
    trimCapacity(m_partners);
    trimCapacity(m_separatedPairs);
    trimCapacity(m_scratch);
}

void PairSync::detectExternalChanges()
{
    const btOverlapFilterCallback* filter = m_adapter.filterCallback();
    if (filter != m_filter)
    {
        // Without a callback the backend drops pairs by group and mask, which a callback may let pass, and holds all listed
        // pairs, which a callback may allow while they are near.
        if (m_filter == nullptr || filter == nullptr)
            m_state.restart();
        m_state.reevaluate();
        m_filter = filter;
    }
    const std::uint64_t externalChanges = m_adapter.externalChanges();
    const bool isChanged = m_adapter.count() != m_expectedCount || externalChanges != m_externalChanges;
    m_externalChanges = externalChanges;
    if (isChanged)
        m_state.changeCache();
}

bool PairSync::runBackend(const ProxyView& view, bool needsRestart)
{
    if (m_allowedPairs != nullptr && !needsRestart && updateAllowedPairs(view))
        return true;
    if (m_allowedPairs != nullptr || needsRestart)
        restartBackend();
    const Status status = m_backend->update(view, m_delta);
    if (status == Status::Ok)
        return true;
    replaceBackend(status);
    restartBackend();
    if (m_backend->update(view, m_delta) == Status::Ok)
        return true;
    log(LogLevel::Error, "the fallback backend failed too; pairs stay as they are until the next update");
    return false;
}

void PairSync::replaceBackend(Status status)
{
    const std::string reason = status == Status::OutOfMemory ? "out of memory" : "device lost";
    const std::string message = std::string("backend '") + m_backend->name() + "' failed (" + reason +
                                "); the grid on the CPU takes over";
    log(LogLevel::Warning, message.c_str());
    useBackend(makeFallbackBackend(m_options));
    ++m_fallbacksTotal;
}

void PairSync::restartBackend()
{
    m_allowedPairs.reset();
    m_scratch.clear();
    const btBroadphasePairArray& cached = m_adapter.cache()->getOverlappingPairArray();
    for (int i = 0; i < cached.size(); ++i)
    {
        // A cache may also contain proxies of another broad phase that uses it.
        const btBroadphasePair& pair = cached[i];
        if (!m_store.owns(pair.m_pProxy0) || !m_store.owns(pair.m_pProxy1))
            continue;
        // The application may have added a deferred pair.
        m_deferredPairs.erase(pairOf(pair));
        m_scratch.push_back(pairOf(pair));
    }
    m_scratch.insert(m_scratch.end(), m_deferredPairs.pairs().begin(), m_deferredPairs.pairs().end());
    sortUnique(m_scratch);
    m_backend->restart(m_scratch);
    m_deferredPairs.followRestart();
    m_speculativePairs.clear();
    ++m_restartsTotal;
}

/// Whether a pair that the backend reports as new after a restart existed before and only the cache lacks it.
///
/// If one of the boxes has changed, that is unknown, and so is the old box; the pair is then added, to miss none.
bool PairSync::isExternallyRemoved(Pair pair, const ProxyView& view) const
{
    const Proxy* first = m_store.find(pair.first);
    const Proxy* second = m_store.find(pair.second);
    return first != nullptr && second != nullptr && view.changes[ProxyStore::rowOf(first)] == kRowUnchanged &&
           view.changes[ProxyStore::rowOf(second)] == kRowUnchanged;
}

void PairSync::deferExternallyRemoved(const ProxyView& view)
{
    const auto isToDefer = [&](Pair pair) { return isExternallyRemoved(pair, view); };
    for (const Pair pair : m_delta.added)
    {
        if (!isToDefer(pair))
            continue;
        m_deferredPairs.insert(pair, ProxyStore::rowOf(m_store.find(pair.first)),
                               ProxyStore::rowOf(m_store.find(pair.second)), DeferredPairs::kRefused,
                               view.boxes, view.margin);
        ++m_refusedNow;
    }
    if (m_deferredPairs.isFull())
        markRefused();
    m_delta.added.erase(std::remove_if(m_delta.added.begin(), m_delta.added.end(), isToDefer),
                        m_delta.added.end());
}

void PairSync::collectToReevaluate(const ProxyView& view, bool mustReevaluateAll)
{
    m_toReevaluate.clear();
    m_deferredPairs.collectToReevaluate(view, m_toReevaluate, m_due);
    if (mustReevaluateAll)
        m_toReevaluate = m_deferredPairs.pairs();
    if (m_toReevaluate.empty())
        return;
    sortUnique(m_toReevaluate);
    // The backend has dropped separated pairs: they are no longer deferred, and new when they overlap again.
    const auto hasSeparated = [&](Pair pair)
    { return std::binary_search(m_delta.removed.begin(), m_delta.removed.end(), pair); };
    m_toReevaluate.erase(std::remove_if(m_toReevaluate.begin(), m_toReevaluate.end(), hasSeparated),
                         m_toReevaluate.end());
}

/// Whether both boxes are valid: the coordinates of an empty box may overlap an infinite box.
bool PairSync::haveValidBoxes(const Proxy& first, const Proxy& second) const
{
    const ProxyTable& table = m_store.table();
    return isValid(table.box(ProxyStore::rowOf(&first))) && isValid(table.box(ProxyStore::rowOf(&second)));
}

bool PairSync::areSeparated(Pair pair, float margin) const
{
    const Proxy* first = m_store.find(pair.first);
    const Proxy* second = m_store.find(pair.second);
    if (first == nullptr || second == nullptr)
        return true;
    return !haveValidBoxes(*first, *second) || areSeparatedBy(*first, *second, margin);
}

/// Defers the pairs that have just been removed from the cache but not from the backend.
void PairSync::deferSeparated(float margin)
{
    for (const Pair pair : m_separatedPairs)
    {
        const Proxy* first = m_store.find(pair.first);
        const Proxy* second = m_store.find(pair.second);
        const bool isInBackend = !std::binary_search(m_delta.removed.begin(), m_delta.removed.end(), pair);
        if (first == nullptr || second == nullptr || !isInBackend)
            continue;
        if (m_speculativePairs.contains(pair))
            deferNear(pair, *first, *second, margin);
        else
            defer(pair, *first, *second, false, margin);
    }
}

void PairSync::applyRemoved(float margin, btDispatcher* dispatcher)
{
    if (m_separatedPairs.empty() && m_delta.removed.empty() && m_speculativePairs.size() == 0)
        return;
    if (m_separatedPairs.empty() && m_speculativePairs.size() == 0 && m_deferredPairs.size() == 0)
        return removeFromCache(m_delta.removed, dispatcher);
    deferSeparated(margin);
    m_scratch = m_separatedPairs;
    for (const Pair pair : m_delta.removed)
    {
        if (!m_deferredPairs.erase(pair))
            m_scratch.push_back(pair);
    }
    for (const Pair pair : m_speculativePairs.pairs())
    {
        if (areSeparated(pair, margin))
            m_scratch.push_back(pair);
    }
    if (m_speculativePairs.size() != 0)
    {
        for (const Pair pair : m_scratch)
            m_speculativePairs.erase(pair);
    }
    // Each part is sorted; usually their concatenation is too.
    if (!std::is_sorted(m_scratch.begin(), m_scratch.end()))
        sortUnique(m_scratch);
    removeFromCache(m_scratch, dispatcher);
}

void PairSync::removeFromCache(const Pairs& pairs, btDispatcher* dispatcher)
{
    if (m_onRemovals)
        m_onRemovals(pairs);
    m_adapter.remove(pairs, m_store, dispatcher);
}

/// Whether the exact boxes overlap, after callbacks may have changed them.
bool PairSync::overlapNow(const Proxy& first, const Proxy& second) const
{
    return haveValidBoxes(first, second) && overlapsExactly(first, second);
}

/// Adds or defers a pair that the callbacks of the application may let pass.
///
/// @param isAbsent whether the cache is known to lack the pair before these run
/// @return whether the pair is in the cache now
bool PairSync::tryAdd(Pair pair, bool isAbsent, float margin)
{
    Proxy* first = m_store.find(pair.first);
    Proxy* second = m_store.find(pair.second);
    if (first == nullptr || second == nullptr || m_speculativePairs.erase(pair))
        return false;
    const bool exactBoxesOverlap = overlapNow(*first, *second);
    if (m_deferredPairs.isNear(pair))
    {
        if (!exactBoxesOverlap)
        {
            deferNear(pair, *first, *second, margin);
            return false;
        }
        // Not reported just now: its box is one of the next update, or the backend held it when the filter refused it.
        // Which one, the backend shows after a restart.
        m_state.restart();
    }
    const std::uint64_t withoutMemory = m_adapter.pairsWithoutMemory();
    if (exactBoxesOverlap && m_adapter.add(*first, *second, isAbsent))
    {
        m_deferredPairs.erase(pair);
        return true;
    }
    if (m_adapter.pairsWithoutMemory() != withoutMemory)
    {
        // The filter has not refused the pair: the next update restarts the backend and adds it.
        m_deferredPairs.erase(pair);
        m_state.restart();
        return false;
    }
    // The filter is code of the application, and may have destroyed one of the proxies.
    if (m_store.find(pair.first) == first && m_store.find(pair.second) == second)
        defer(pair, *first, *second, exactBoxesOverlap, margin);
    return false;
}

void PairSync::defer(Pair pair, const Proxy& first, const Proxy& second, bool exactBoxesOverlap, float margin)
{
    m_refusedNow += exactBoxesOverlap ? 1u : 0u;
    if (exactBoxesOverlap && m_allowedPairs != nullptr)
    {
        m_deferredPairs.erase(pair);
        m_allowedPairs->erase(ProxyStore::rowOf(&first), ProxyStore::rowOf(&second));
        return;
    }
    m_deferredPairs.insert(pair, ProxyStore::rowOf(&first), ProxyStore::rowOf(&second),
                           exactBoxesOverlap ? DeferredPairs::kRefused : DeferredPairs::kSeparated,
                           m_store.table().boxes(), margin);
    if (exactBoxesOverlap && m_deferredPairs.isFull())
        markRefused();
}

/// Defers a pair of boxes that do not overlap and that the backend may not hold, while they are within the margin.
void PairSync::deferNear(Pair pair, const Proxy& first, const Proxy& second, float margin)
{
    if (areNearInTable(first, second, margin))
        m_deferredPairs.insert(pair, ProxyStore::rowOf(&first), ProxyStore::rowOf(&second),
                               DeferredPairs::kNear, m_store.table().boxes(), margin);
    else
        m_deferredPairs.erase(pair);
}

void PairSync::addImmediately(Proxy& a, Proxy& b)
{
    if (!overlapNow(a, b) || m_adapter.contains(a, b))
        return;
    Proxy& first = uniqueIdOf(&a) < uniqueIdOf(&b) ? a : b;
    Proxy& second = uniqueIdOf(&a) < uniqueIdOf(&b) ? b : a;
    const Pair pair = {uniqueIdOf(&first), uniqueIdOf(&second)};
    const std::uint32_t rowFirst = ProxyStore::rowOf(&first);
    const std::uint32_t rowSecond = ProxyStore::rowOf(&second);
    const ProxyTable& table = m_store.table();
    const bool isRefiltered = ((table.changes(rowFirst) | table.changes(rowSecond)) & kRowRefiltered) != 0;
    if (!isRefiltered && m_deferredPairs.isRefusalCurrent(pair, rowFirst, rowSecond, table.boxes()))
        return;
    if (!m_adapter.add(first, second, false))
        return;
    ++m_expectedCount;
    const bool mayBeNew = m_deferredPairs.isNear(pair);
    if (m_deferredPairs.erase(pair) && !mayBeNew)
        return;
    try
    {
        m_speculativePairs.insert(pair);
    }
    catch (const std::bad_alloc&)
    {
        // The next update restarts the backend from the cache, which has the pair.
        m_state.restart();
        throw;
    }
}

void PairSync::removePairsOf(Proxy& proxy, btDispatcher* dispatcher)
{
    const int before = m_adapter.count();
    m_adapter.removePairsOf(proxy, dispatcher);
    m_expectedCount += m_adapter.count() - before;
    m_deferredPairs.eraseAllOf(uniqueIdOf(&proxy), ProxyStore::rowOf(&proxy));
    m_speculativePairs.eraseAllOf(uniqueIdOf(&proxy));
}

void PairSync::skipChanges()
{
    m_store.table().beginUpdate(0.0f, false);
    m_store.endUpdate();
    m_state.restart();
    m_state.reevaluate();
}

void PairSync::addTo(BroadphaseStats& stats) const
{
    stats.pairs = static_cast<std::uint64_t>(m_adapter.count());
    stats.pendingPairs = m_deferredPairs.size();
    stats.provisionalPairs = m_speculativePairs.size();
    stats.updatesTotal = m_updatesTotal;
    stats.restartsTotal = m_restartsTotal;
    stats.fallbacksTotal = m_fallbacksTotal;
    stats.bytes += m_deferredPairs.bytes() + m_speculativePairs.bytes() +
                   (m_delta.added.capacity() + m_delta.removed.capacity() + m_toReevaluate.capacity() +
                    m_separatedPairs.capacity() + m_scratch.capacity()) *
                       sizeof(Pair) +
                   (m_due.capacity() + m_partners.capacity()) * sizeof(std::uint32_t);
    stats.backendName = m_backend->name();
    stats.backend = m_backend->stats();
    if (m_quietBoxes.isQuiet())
    {
        stats.backend.path = "quiet";
        stats.backend.candidates = 0;
    }
    if (m_allowedPairs == nullptr)
        return;
    const std::uint64_t backendBytes = stats.backend.bytes;
    stats.backend = {};
    stats.backend.path = "allowed pairs";
    stats.backend.pairs = m_allowedPairs->size();
    stats.backend.candidates = m_allowedPairs->tests();
    stats.backend.bytes = backendBytes + m_allowedPairs->bytes();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
