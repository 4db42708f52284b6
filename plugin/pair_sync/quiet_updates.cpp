// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The part of PairSync that leaves out updates.
#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/pair_sync/pair_sync.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether the backend is in sync and holds the pairs of the cache and no others.
bool PairSync::hasOnlyHeldPairs() const
{
    return m_isGrid && m_filter == nullptr && m_state.state() == SyncState::State::InSync &&
           !m_deferredPairs.mayHavePairs() && m_speculativePairs.size() == 0 && m_allowedPairs == nullptr;
}

/// Whether an update would change nothing: no box has moved far enough for that.
bool PairSync::isQuiet(float margin)
{
    return hasOnlyHeldPairs() && m_quietBoxes.absorb(m_store.table(), margin);
}

void PairSync::measureRooms(float margin)
{
    QuietBoxes::Held held{};
    const btBroadphasePairArray& cached = m_adapter.cache()->getOverlappingPairArray();
    for (int i = 0; i < cached.size(); ++i)
    {
        // As in restartBackend().
        if (!m_store.owns(cached[i].m_pProxy0) || !m_store.owns(cached[i].m_pProxy1))
            continue;
        const std::uint32_t a = ProxyStore::rowOf(static_cast<Proxy*>(cached[i].m_pProxy0));
        const std::uint32_t b = ProxyStore::rowOf(static_cast<Proxy*>(cached[i].m_pProxy1));
        held[a] |= std::uint64_t{1} << b;
        held[b] |= std::uint64_t{1} << a;
    }
    m_quietBoxes.measure(m_store.table(), held, margin);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
