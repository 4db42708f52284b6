// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Crowds of boxes most pairs of which a filter callback refuses, so many that they are not listed, compared with brute
// force: boxes walk, teleport, come and go, filters and filter words change, rays and boxes are asked in between.

#include "cullet/plugin/broadphase.h"
#include "cullet/tests/fuzz/backend_choice.h"
#include "cullet/tests/fuzz/box_choice.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/worlds/watched_broadphase.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
const char* const kFuzzTargetName = "refusals";

namespace
{
class RefusalsRun
{
public:
    RefusalsRun(const std::uint8_t* data, std::size_t size) : m_choices(data, size)
    {
        BroadphaseOptions options;
        options.threads = m_choices.of({1, 2});
        options.margin = m_choices.of({btScalar(-1), btScalar(0), btScalar(0.01), btScalar(0.5)});
        m_reach = m_choices.of({0.0f, 1.0f, 2.0f, 0.25f});
        const std::uint32_t count = 60 + m_choices.below(60);
        m_noise = Noise(m_choices.byte());
        auto inner = std::make_unique<Broadphase>(chosenBackend(m_choices), nullptr, options);
        m_broadphase = inner.get();
        m_broadphase->getOverlappingPairCache()->setInternalGhostPairCallback(&m_ghostCallback);
        m_watched = std::make_unique<WatchedBroadphase>(std::move(inner), WatchedBroadphase::Promise::Exact,
                                                        options.margin, true);
        for (PairFilter& filter : m_filters)
            filter.onCall = [this] { countCall(); };
        useFilter(1);
        for (std::uint32_t i = 0; i < count; ++i)
            create(i % 16 == 15);
        update();
    }

    ~RefusalsRun()
    {
        disarm();
        while (!m_bodies.empty())
            destroy(m_bodies.size() - 1);
    }

    std::string run()
    {
        for (m_choices.nextOperation(); !m_choices.isEmpty() && m_watched->fault().empty();
             m_choices.nextOperation())
        {
            m_noise = Noise(m_choices.byte());
            guarded([this] { operate(); });
            disarm();
            m_watched->checkPairs();
            if (!m_choices.chance(64))
                update();
        }
        update();
        update();
        return m_watched->fault();
    }

private:
    enum class Operation
    {
        Walk,
        MoveOne,
        Teleport,
        Gather,
        Create,
        Destroy,
        Refilter,
        UseFilter,
        Query,
        UpdateArmed,
        SetStrangeBox,
        ChangeBackend,
        DestroyAll,
        kCount
    };

    struct Body
    {
        std::unique_ptr<btCollisionObject> client;
        btBroadphaseProxy* proxy;
    };

    static constexpr std::size_t kMostBodies = 128;

    void operate()
    {
        switch (static_cast<Operation>(m_choices.below(static_cast<std::uint32_t>(Operation::kCount))))
        {
            case Operation::Walk:
                return walk(m_choices.of({0.02f, 0.2f, 0.004f}), m_choices.of({1u, 1u, 7u}));
            case Operation::MoveOne:
                return moveBy(any(), m_choices.of({0.03f, 0.3f, 1.0f}));
            case Operation::Teleport:
                return place(any(), placeIn(m_choices.of({m_reach, 30.0f})));
            case Operation::Gather:
                return gather(m_choices.of({m_reach, 0.0f, 40.0f, 3.0f}));
            case Operation::Create:
                return createSome(1 + m_choices.below(12));
            case Operation::Destroy:
                return destroySome(1 + m_choices.below(12));
            case Operation::Refilter:
                return refilter();
            case Operation::UseFilter:
                return useFilter(m_choices.below(kFilters + 1));
            case Operation::Query:
                return query();
            case Operation::UpdateArmed:
                return updateArmed();
            case Operation::SetStrangeBox:
                return setStrangeBox();
            case Operation::ChangeBackend:
                return m_broadphase->setBackend(chosenBackend(m_choices));
            default:
                return destroyAll();
        }
    }

    template <class Action>
    void guarded(Action action)
    {
        try
        {
            action();
        }
        catch (const CallbackFailure&)
        {
        }
    }

    void update()
    {
        guarded([this] { m_watched->calculateOverlappingPairs(nullptr); });
    }

    std::size_t any() { return m_choices.byte() % std::max<std::size_t>(m_bodies.size(), 1); }

    btVector3 placeIn(float reach)
    {
        const float x = m_noise.upTo(reach), y = m_noise.upTo(reach), z = m_noise.upTo(reach);
        return btVector3(x, y, z);
    }

    void create(bool isGhost)
    {
        if (m_bodies.size() == kMostBodies)
            return;
        Body body;
        body.client = isGhost ? std::make_unique<btGhostObject>() : std::make_unique<btCollisionObject>();
        const btVector3 low = placeIn(m_reach);
        const int group = m_noise.upTo(1) < 0 ? 1 : 2;
        body.proxy =
            m_watched->createProxy(low, low + btVector3(1, 1, 1), 0, body.client.get(), group, -1, nullptr);
        m_bodies.push_back(std::move(body));
    }

    void destroy(std::size_t index)
    {
        if (index >= m_bodies.size())
            return;
        const Body body = std::move(m_bodies[index]);
        m_bodies.erase(m_bodies.begin() + static_cast<std::ptrdiff_t>(index));
        m_watched->destroyProxy(body.proxy, nullptr);
    }

    void createSome(std::uint32_t count)
    {
        const bool areGhosts = m_choices.chance(64);
        for (std::uint32_t i = 0; i < count; ++i)
            create(areGhosts && i % 4 == 0);
    }

    void destroySome(std::uint32_t count)
    {
        const std::size_t first = any();
        for (std::uint32_t i = 0; i < count; ++i)
            destroy(first);
    }

    void destroyAll()
    {
        if (!m_choices.chance(64))
            return;
        const std::size_t count = m_bodies.size();
        while (!m_bodies.empty())
            destroy(m_bodies.size() - 1);
        m_watched->resetPool(nullptr);
        for (std::size_t i = 0; i < count; ++i)
            create(false);
    }

    void place(std::size_t index, const btVector3& low)
    {
        if (index < m_bodies.size())
            m_watched->setAabb(m_bodies[index].proxy, low, low + btVector3(1, 1, 1), nullptr);
    }

    void moveBy(std::size_t index, float reach)
    {
        if (index < m_bodies.size())
            place(index, m_bodies[index].proxy->m_aabbMin + placeIn(reach));
    }

    void walk(float reach, std::size_t stride)
    {
        for (std::size_t i = 0; i < m_bodies.size(); i += stride)
            moveBy(i, reach);
    }

    void gather(float reach)
    {
        for (std::size_t i = 0; i < m_bodies.size(); ++i)
            place(i, placeIn(reach));
    }

    /// As motion planners do: new words, pairs cleaned, and the box set again.
    void refilter()
    {
        const std::size_t index = any();
        if (index >= m_bodies.size())
            return;
        btBroadphaseProxy& proxy = *m_bodies[index].proxy;
        proxy.m_collisionFilterGroup = m_choices.of({1, 2, 4});
        m_watched->getOverlappingPairCache()->cleanProxyFromPairs(&proxy, nullptr);
        if (!m_choices.chance(64))
            m_watched->setAabb(&proxy, proxy.m_aabbMin, proxy.m_aabbMax, nullptr);
    }

    /// @param which 0: none
    void useFilter(std::uint32_t which)
    {
        m_watched->getOverlappingPairCache()->setOverlapFilterCallback(which == 0 ? nullptr
                                                                                  : &m_filters[which - 1]);
    }

    void query()
    {
        const btVector3 from = placeIn(4), to = placeIn(4);
        const btScalar half = m_choices.of({btScalar(0), btScalar(0.5), btScalar(2)});
        m_watched->checkQueries(from, to, btVector3(half, half / 2, half));
    }

    void setStrangeBox()
    {
        const std::size_t index = any();
        const Aabb box = chosenStrangeBox(m_choices);
        if (index < m_bodies.size())
            m_watched->setAabb(m_bodies[index].proxy, btVector3(box.min[0], box.min[1], box.min[2]),
                               btVector3(box.max[0], box.max[1], box.max[2]), nullptr);
    }

    /// An update in which the filter does something in one of its calls.
    void updateArmed()
    {
        const std::uint32_t kind = m_choices.below(6);
        const std::size_t body = any();
        const int delay = static_cast<int>(m_choices.below(200));
        walk(m_choices.of({0.2f, 0.02f}), 1);
        m_callsUntilAction = delay;
        m_action = [this, kind, body] { act(kind, body); };
        m_watched->calculateOverlappingPairs(nullptr);
    }

    void countCall()
    {
        if (m_callsUntilAction >= 0 && m_callsUntilAction-- == 0)
            m_action();
    }

    void act(std::uint32_t kind, std::size_t body)
    {
        if (kind == 0 || kind == 4)
            create(false);
        if (kind == 1 || kind == 4)
            destroy(body);
        if (kind == 2)
            place(body, placeIn(m_reach));
        if (kind == 5)
            place(body, placeIn(50));
        if (kind == 3)
            throw CallbackFailure();
    }

    void disarm() { m_callsUntilAction = -1; }

    static constexpr std::uint32_t kFilters = 5;

    Choices m_choices;
    Noise m_noise{0};
    float m_reach = 0;
    int m_callsUntilAction = -1;  ///< negative: none
    std::function<void()> m_action;
    btGhostPairCallback m_ghostCallback;
    PairFilter m_filters[kFilters] = {
        {1, false, 0x0001}, {2, false, 0x0000}, {3, true, 0x0101}, {4, false, 0x1111}, {5, false, 0x5555}};
    Broadphase* m_broadphase = nullptr;  // inside m_watched
    std::vector<Body> m_bodies;
    std::unique_ptr<WatchedBroadphase> m_watched;
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    return RefusalsRun(data, size).run();
}
}  // namespace cullet::test
