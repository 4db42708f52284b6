// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/pair_cache_twin.h"

namespace cullet::test
{
void PairCacheTwin::add(std::size_t a, std::size_t b, bool withAlgorithm)
{
    btBroadphaseProxy *first = m_proxies[a], *second = m_proxies[b];
    const Ids ids = idsOfProxies(first, second);
    if (isBeingAdded(ids))
    {
        const bool isKnown = m_pairs.count(ids) != 0;
        require((m_cache.addOverlappingPair(first, second) != nullptr) == isKnown,
                "the same pair is added within its own addition", ids);
        return;
    }
    Frame frame{ids, m_frame, passesWords(first, second), false};
    m_frame = &frame;
    const bool hasFilter = m_cache.getOverlapFilterCallback() != nullptr;
    frame.isWanted = wanted(frame);
    btBroadphasePair* pair = m_cache.addOverlappingPair(first, second);
    m_frame = frame.outer;
    if (!m_hasGhosts && frame.isWanted && m_pairs.count(ids) == 0)
        insert(ids);
    const auto known = m_pairs.find(ids);
    const bool isExpected = (hasFilter ? frame.isPassed : passesWords(first, second)) &&
                            ids.first != ids.second && known != m_pairs.end() && !frame.isCancelled;
    require((pair != nullptr) == isExpected, "addOverlappingPair() returns the wrong of null and pair", ids);
    if (pair == nullptr || !m_fault.empty())
        return;
    require(test::idsOf(*pair) == ids, "addOverlappingPair() returns another pair", ids);
    require(pair->m_algorithm == known->second.algorithm, "another algorithm after addOverlappingPair()",
            ids);
    mark(*pair, known->second);
    if (withAlgorithm && pair->m_algorithm == nullptr)
        giveAlgorithm(*pair, known->second);
}

void PairCacheTwin::remove(std::size_t a, std::size_t b, bool byIds, bool hasDispatcher)
{
    const Ids ids = idsOfProxies(m_proxies[a], m_proxies[b]);
    const std::uint64_t serial = serialOf(ids);
    void* const expected = serial != 0 && m_pairs[ids].hasInfo ? reinterpret_cast<void*>(serial) : nullptr;
    if (serial == 0)
        cancelFilters([&](Ids other) { return other == ids; });
    Removing removing(*this, hasDispatcher);
    const std::uint64_t callsBefore = m_removingCalls;
    void* info = byIds ? m_cache.removePair(makePair(bits(ids.first), bits(ids.second)), removing.dispatcher)
                       : m_cache.removeOverlappingPair(m_proxies[a], m_proxies[b], removing.dispatcher);
    if (!m_hasGhosts && serial != 0)
        erase(ids);
    require(serialOf(ids) != serial || serial == 0, "pair still there after its removal", ids);
    // Null if the destructor of the algorithm has removed the pair.
    const bool isTaken = info == nullptr && m_removingCalls != callsBefore;
    require(isTaken || info == expected, "wrong m_internalInfo1 returned", ids);
}

void PairCacheTwin::removeOf(std::size_t a)
{
    const int id = m_proxies[a]->m_uniqueId;
    const auto isOfProxy = [id](Ids ids) { return ids.first == id || ids.second == id; };
    Removing removing(*this, true);
    // Additions whose filter runs are cancelled after the removals; no callback lies between that and here.
    m_cache.removeOverlappingPairsContainingProxy(m_proxies[a], &m_dispatcher);
    cancelFilters(isOfProxy);
    std::vector<Ids> gone;
    for (const auto& [ids, entry] : m_pairs)
        if (isOfProxy(ids))
            gone.push_back(ids);
    for (const Ids& ids : gone)
        m_hasGhosts ? require(m_additionsCancelled, "pair of a removed proxy", ids) : erase(ids);
}

void PairCacheTwin::clean(std::size_t a, bool hasDispatcher)
{
    const int id = m_proxies[a]->m_uniqueId;
    std::map<Ids, std::uint64_t> cleaned;
    for (const auto& [ids, entry] : m_pairs)
        if (hasDispatcher && (ids.first == id || ids.second == id))
            cleaned[ids] = entry.serial;
    Removing removing(*this, hasDispatcher);
    m_cache.cleanProxyFromPairs(m_proxies[a], removing.dispatcher);
    for (const auto& [ids, serial] : cleaned)
    {
        const auto known = m_pairs.find(ids);
        if (known != m_pairs.end() && known->second.serial == serial)
            require(known->second.algorithm == nullptr || known->second.isRenewed, "algorithm not cleaned",
                    ids);
    }
}

void PairCacheTwin::cleanPair(std::size_t a, std::size_t b)
{
    Removing removing(*this, true);
    if (btBroadphasePair* pair = m_cache.findPair(m_proxies[a], m_proxies[b]))
        m_cache.cleanOverlappingPair(*pair, &m_dispatcher);
}

void PairCacheTwin::find(std::size_t a, std::size_t b)
{
    const Ids ids = idsOfProxies(m_proxies[a], m_proxies[b]);
    const btBroadphasePair* pair = m_cache.findPair(m_proxies[a], m_proxies[b]);
    require((pair != nullptr) == (m_pairs.count(ids) != 0), "findPair() finds the wrong of null and pair",
            ids);
    require(pair == nullptr || test::idsOf(*pair) == ids, "findPair() finds another pair", ids);
    require(m_cache.findPair(makePair(bits(ids.first), bits(ids.second))) == pair,
            "findPair() by ids differs", ids);
    require(m_cache.findPair(m_proxies[b], m_proxies[a]) == pair, "findPair() differs in the other order",
            ids);
}

void PairCacheTwin::sort()
{
    m_cache.sortOverlappingPairs(&m_dispatcher);
    if (m_passes == nullptr && !m_isRemoving)
        require(isDescending(test::idsOf(m_cache)), "not sorted", {});
}

void PairCacheTwin::process(bool isOrdered, const std::function<bool(std::uint64_t)>& goes)
{
    Pass pass{isOrdered, m_passes, {}, {}, 0, m_serial, false};
    for (const auto& [ids, entry] : m_pairs)
        pass.before.insert(ids);
    m_passes = &pass;
    ++m_removingCalls;
    Visit visit([&](btBroadphasePair& pair) { return visitPair(pass, pair, goes); });
    btDispatcherInfo info;
    info.m_deterministicOverlappingPairs = isOrdered;
    m_cache.processAllOverlappingPairs(&visit, &m_dispatcher, info);
    m_passes = pass.outer;
    require(!isOrdered || isDescending(visit.visited), "pairs visited out of order", {});
    checkSkipped(pass);
}

void PairCacheTwin::addMany(const std::vector<std::pair<std::size_t, std::size_t>>& rows)
{
    std::vector<ProxyPair> pairs;
    Pairs coming;
    for (const auto& [a, b] : rows)
    {
        pairs.push_back({m_proxies[a], m_proxies[b]});
        coming.push_back(makePair(uniqueIdOf(m_proxies[a]), uniqueIdOf(m_proxies[b])));
    }
    for (std::size_t i = 0; i < pairs.size(); ++i)
    {
        m_cache.prefetchAddition(&coming[i], coming.size() - i);
        m_cache.addPairUnfiltered(pairs[i].first, pairs[i].second);
    }
    for (const ProxyPair& pair : pairs)
    {
        const Ids ids = idsOfProxies(pair.first, pair.second);
        // Its filter, which runs, has the last word.
        if (!m_hasGhosts && ids.first != ids.second && m_pairs.count(ids) == 0 && !isBeingAdded(ids))
            insert(ids);
        btBroadphasePair* known = m_cache.findPair(pair.first, pair.second);
        if (known != nullptr && m_pairs.count(ids) != 0)
            mark(*known, m_pairs[ids]);
    }
}

void PairCacheTwin::removeMany(const std::vector<std::pair<std::size_t, std::size_t>>& rows)
{
    Pairs pairs;
    for (const auto& [a, b] : rows)
        pairs.push_back(makePair(bits(m_proxies[a]->m_uniqueId), bits(m_proxies[b]->m_uniqueId)));
    // Those of an update are ascending; most of all pairs then leave together.
    if (rows.size() > 32)
        std::sort(pairs.begin(), pairs.end());
    Removing removing(*this, true);
    m_cache.removePairs(pairs.data(), pairs.size(), &m_dispatcher);
    for (const auto& [a, b] : rows)
        if (!m_hasGhosts)
            erase(idsOfProxies(m_proxies[a], m_proxies[b]));
}

void PairCacheTwin::check()
{
    require(m_cache.isConsistent(), "not consistent", {});
    require(static_cast<std::size_t>(m_cache.getNumOverlappingPairs()) == m_pairs.size(),
            "wrong number of pairs", {});
    std::set<int> proxies;
    for (int i = 0; i < m_cache.getNumOverlappingPairs() && m_fault.empty(); ++i)
    {
        const btBroadphasePair& pair = m_cache.getOverlappingPairArrayPtr()[i];
        const auto known = m_pairs.find(test::idsOf(pair));
        require(known != m_pairs.end(), "pair that should not be there", test::idsOf(pair));
        if (m_fault.empty())
            require(pair.m_algorithm == known->second.algorithm, "another algorithm", known->first);
        proxies.insert({test::idsOf(pair).first, test::idsOf(pair).second});
    }
    require(m_cache.stats().proxies == (m_cache.isLinked() ? proxies.size() : 0),
            "wrong number of proxies with pairs", {});
    require(m_ghosts.forbiddenCalls == 0, "forbidden ghost callback", {});
    require(m_dispatcher.freedCount == m_dispatcher.destroyedCount, "algorithm destroyed and not freed", {});
}

PairCacheTwin::Ids PairCacheTwin::idsOfProxies(const btBroadphaseProxy* a, const btBroadphaseProxy* b)
{
    return std::minmax(a->m_uniqueId, b->m_uniqueId);
}

bool PairCacheTwin::passesWords(const btBroadphaseProxy* a, const btBroadphaseProxy* b)
{
    return (a->m_collisionFilterGroup & b->m_collisionFilterMask) != 0 &&
           (b->m_collisionFilterGroup & a->m_collisionFilterMask) != 0;
}

bool PairCacheTwin::isDescending(const std::vector<Ids>& list)
{
    return std::adjacent_find(list.begin(), list.end(), std::less_equal<Ids>()) == list.end();
}

bool PairCacheTwin::wanted(const Frame& frame) const
{
    if (!frame.isPassed || frame.isCancelled || frame.ids.first == frame.ids.second ||
        m_pairs.count(frame.ids) != 0)
        return false;
    return !isBeingReported(frame.ids);
}

bool PairCacheTwin::isBeingReported(Ids ids) const
{
    for (const Report* report = m_reports; report != nullptr; report = report->outer)
        if (report->ids == ids)
            return true;
    return false;
}

bool PairCacheTwin::isBeingAdded(Ids ids) const
{
    for (const Frame* frame = m_frame; frame != nullptr; frame = frame->outer)
        if (frame->isFiltering && frame->ids == ids)
            return true;
    return isBeingReported(ids);
}

bool PairCacheTwin::filter(const btBroadphaseProxy* a, const btBroadphaseProxy* b)
{
    Frame* frame = m_frame;
    if (frame == nullptr || frame->ids != idsOfProxies(a, b))
    {
        require(false, "filter called for another pair", idsOfProxies(a, b));
        return false;
    }
    frame->isFiltering = true;
    onCallback(frame->ids);
    frame->isFiltering = false;
    frame->isPassed = (a->m_uniqueId ^ b->m_uniqueId) % 5 != 0;
    frame->isWanted = wanted(*frame);
    return frame->isPassed;
}

void PairCacheTwin::ghostAdds(Ids ids)
{
    require(m_pairs.count(ids) == 0 && m_reported.insert(ids).second, "ghost callback gets a pair twice",
            ids);
    if (m_frame != nullptr && m_frame->ids == ids)
        require(m_frame->isWanted, "ghost callback gets a pair that is not to be added", ids);
    Report report{ids, m_reports, false};
    m_reports = &report;
    onCallback(ids);
    m_reports = report.outer;
    if (!report.isCancelled)
        insert(ids);
}

void PairCacheTwin::ghostRemoves(Ids ids)
{
    require(m_reported.erase(ids) == 1, "ghost callback loses a pair that it does not have", ids);
    if (m_pairs.count(ids) != 0)
    {
        erase(ids);
    }
    else
    {
        m_additionsCancelled = true;
        for (Report* report = m_reports; report != nullptr; report = report->outer)
            report->isCancelled |= report->ids == ids;
    }
    onCallback(ids);
}

bool PairCacheTwin::visitPair(Pass& pass, const btBroadphasePair& pair,
                              const std::function<bool(std::uint64_t)>& goes)
{
    const Ids ids = test::idsOf(pair);
    const std::uint64_t serial = serialOf(ids);
    require(serial != 0, "visited pair does not exist", ids);
    require(pass.visited.insert(serial).second, "pair visited twice", ids);
    // A pair that was removed and added again before its turn keeps it.
    require(!pass.isOrdered || serial <= pass.lastBefore || pass.before.count(ids) != 0,
            "pair visited that was added during the pass", ids);
    pass.current = serial;
    onCallback(ids);
    const bool isGoing = goes(serial);
    // The cache removes the pair when this returns.
    if (isGoing && !m_hasGhosts && serialOf(ids) == serial)
        m_hasAlgorithmToLose = true, erase(ids);
    return isGoing;
}

void PairCacheTwin::checkSkipped(const Pass& pass)
{
    for (const auto& [ids, entry] : m_pairs)
    {
        const bool isNew = entry.serial > pass.lastBefore;
        if (pass.visited.count(entry.serial) == 0 && !pass.maySkip && !(pass.isOrdered && isNew))
            require(false, isNew ? "pair added during the pass not visited" : "pair skipped", ids);
    }
}

std::uint64_t PairCacheTwin::serialOf(Ids ids) const
{
    const auto known = m_pairs.find(ids);
    return known == m_pairs.end() ? 0 : known->second.serial;
}

void PairCacheTwin::erase(Ids ids)
{
    const auto known = m_pairs.find(ids);
    if (known == m_pairs.end())
        return;
    const Entry entry = known->second;
    m_pairs.erase(known);
    if (entry.algorithm != nullptr && !m_hasAlgorithmToLose)
        m_leaked.insert(entry.algorithm);
    m_hasAlgorithmToLose = false;
    for (Pass* pass = m_passes; pass != nullptr; pass = pass->outer)
        pass->maySkip |=
            !pass->isOrdered && pass->current != entry.serial && pass->visited.count(entry.serial) != 0;
}

void PairCacheTwin::mark(btBroadphasePair& pair, Entry& entry)
{
    pair.m_internalInfo1 = reinterpret_cast<void*>(entry.serial);
    entry.hasInfo = true;
}

void PairCacheTwin::giveAlgorithm(btBroadphasePair& pair, Entry& entry)
{
    FakeDispatcher::Algorithm* algorithm = m_dispatcher.makeAlgorithm();
    const Ids ids = test::idsOf(pair);
    entry.isRenewed = entry.algorithm == nullptr;
    pair.m_algorithm = entry.algorithm = algorithm;
    algorithm->onDestroy = [this, ids, algorithm]
    {
        m_leaked.erase(algorithm);
        const auto known = m_pairs.find(ids);
        if (known != m_pairs.end() && known->second.algorithm == algorithm)
            known->second.algorithm = nullptr;
        if (m_hasGhosts)
            onCallback(ids);
    };
}

void PairCacheTwin::require(bool holds, const char* fault, Ids ids)
{
    if (!holds && m_fault.empty())
        m_fault = std::string(fault) + ": " + std::to_string(ids.first) + ", " + std::to_string(ids.second);
}
}  // namespace cullet::test
