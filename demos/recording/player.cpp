// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/recording/player.h"

#include "cullet/demos/program/exit_code.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
btVector3 toVector(const double* coordinates)
{
    return btVector3(btScalar(coordinates[0]), btScalar(coordinates[1]), btScalar(coordinates[2]));
}

/// Proxies store their id; the dispatcher is null, as no pair has an algorithm.
class BroadphasePlayer : public Player
{
public:
    explicit BroadphasePlayer(NamedBroadphase broadphase) : m_broadphase(std::move(broadphase)) {}

    ~BroadphasePlayer() override
    {
        // Pairs first, from the end: Bullet's cache scans all pairs for each proxy that is destroyed.
        btOverlappingPairCache& cache = *inner().getOverlappingPairCache();
        while (cache.getNumOverlappingPairs() > 0)
        {
            const btBroadphasePair& last =
                cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
            cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, nullptr);
        }
        for (btBroadphaseProxy* proxy : m_proxies)
        {
            if (proxy != nullptr)
                inner().destroyProxy(proxy, nullptr);
        }
    }

    const std::string& name() const override { return m_broadphase.name; }
    int threads() const override { return m_broadphase.threads; }

    void apply(const std::vector<BoxEvent>& events) override
    {
        const MarginScope margin(m_broadphase.margin);
        for (const BoxEvent& event : events)
            apply(event);
    }

    void findPairs() override
    {
        const MarginScope margin(m_broadphase.margin);
        inner().calculateOverlappingPairs(nullptr);
    }

    Pairs pairs(const RecordedBoxes& boxes) override
    {
        Pairs result;
        const btBroadphasePairArray& all = inner().getOverlappingPairCache()->getOverlappingPairArray();
        for (int i = 0; i < all.size(); ++i)
        {
            const Pair pair = makePair(idOf(*all[i].m_pProxy0), idOf(*all[i].m_pProxy1));
            if (boxes.arePair(pair.first, pair.second))
                result.push_back(pair);
        }
        std::sort(result.begin(), result.end());
        return result;
    }

    std::uint64_t heldPairs() override
    {
        return static_cast<std::uint64_t>(inner().getOverlappingPairCache()->getNumOverlappingPairs());
    }

private:
    btBroadphaseInterface& inner() { return *m_broadphase.broadphase; }

    static std::uint32_t idOf(const btBroadphaseProxy& proxy)
    {
        return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(proxy.m_clientObject) - 1);
    }

    void requireBox(const BoxEvent& event) const
    {
        // Bullet's own trees and arrays cannot store an invalid box.
        if (m_broadphase.cullet == nullptr && !isValid(event.box))
            throw ProgramError(kExitInput, "box " + std::to_string(event.id) +
                                               " of the recording is empty or not a number; '" + name() +
                                               "' cannot take it (cullet's backends can)");
    }

    void apply(const BoxEvent& event)
    {
        switch (event.kind)
        {
            case BoxEvent::Kind::Create:
                requireBox(event);
                create(event);
                break;
            case BoxEvent::Kind::Destroy:
                inner().destroyProxy(m_proxies[event.id], nullptr);
                m_proxies[event.id] = nullptr;
                break;
            case BoxEvent::Kind::Set:
                requireBox(event);
                inner().setAabb(m_proxies[event.id], toVector(event.box.min), toVector(event.box.max),
                                nullptr);
                break;
            case BoxEvent::Kind::Filter:
                m_proxies[event.id]->m_collisionFilterGroup = event.group;
                m_proxies[event.id]->m_collisionFilterMask = event.mask;
                break;
            case BoxEvent::Kind::Frame:
                break;
        }
    }

    void create(const BoxEvent& event)
    {
        if (event.id >= m_proxies.size())
            m_proxies.resize(event.id + 1);
        // An id, not an address: it is never dereferenced.
        void* client =
            reinterpret_cast<void*>(std::uintptr_t(event.id) + 1);  // NOLINT(performance-no-int-to-ptr)
        m_proxies[event.id] = inner().createProxy(toVector(event.box.min), toVector(event.box.max), 0, client,
                                                  event.group, event.mask, nullptr);
    }

    NamedBroadphase m_broadphase;
    std::vector<btBroadphaseProxy*> m_proxies;  ///< by id; null where no box is alive
};

class ExactPlayer : public Player
{
public:
    const std::string& name() const override { return m_name; }
    int threads() const override { return 1; }
    void apply(const std::vector<BoxEvent>& events) override { m_boxes.apply(events); }
    void findPairs() override { m_pairs = m_boxes.exactPairs(); }
    Pairs pairs(const RecordedBoxes&) override { return m_pairs; }
    std::uint64_t heldPairs() override { return m_pairs.size(); }

private:
    std::string m_name = "exact";
    RecordedBoxes m_boxes;
    Pairs m_pairs;
};
}  // namespace

std::unique_ptr<Player> makePlayer(const std::string& name, int threads, const RecordingSummary& summary)
{
    if (name == "exact")
        return std::make_unique<ExactPlayer>();
    BroadphaseRequest request;
    request.name = name;
    request.threads = threads;
    request.worldBounds = summary.bounds;
    for (int axis = 0; axis < 3; ++axis)
    {
        request.worldBounds.min[axis] -= 1.0;
        request.worldBounds.max[axis] += 1.0;
    }
    request.mostProxies = summary.mostBoxes + 16;
    return std::make_unique<BroadphasePlayer>(makeNamedBroadphase(request));
}

std::vector<std::unique_ptr<Player>> makePlayers(const std::vector<std::string>& names, int threads,
                                                 const RecordingSummary& summary)
{
    std::vector<std::unique_ptr<Player>> players;
    for (const std::string& name : names)
        players.push_back(makePlayer(name, threads, summary));
    return players;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
