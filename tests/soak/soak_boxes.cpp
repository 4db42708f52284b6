// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/broadphase.h"
#include "cullet/tests/fuzz/backend_choice.h"
#include "cullet/tests/soak/soak_checks.h"
#include "cullet/tests/soak/soak_world.h"
#include "cullet/tests/support/random.h"
#if defined(CULLET_SOAK_RECORDS)
#include "cullet/plugin/recording_broadphase.h"
#include "cullet/recording/box_stream.h"
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <unistd.h>

namespace cullet::test
{
namespace
{
/// One of all backends of the CPU, with any of their options.
std::unique_ptr<Backend> drawBackend(Random& random)
{
    std::array<std::uint8_t, kOperationBytes> bytes;
    for (std::uint8_t& byte : bytes)
        byte = static_cast<std::uint8_t>(random.below(256));
    Choices choices(bytes.data(), bytes.size());
    return chosenBackend(choices);
}

struct Query final : btBroadphaseAabbCallback
{
    bool process(const btBroadphaseProxy* proxy) override
    {
        ids.push_back(proxy->m_uniqueId);
        return true;
    }
    std::vector<int> ids;
};

/// A world of boxes and the operations on it.
class BoxChurn
{
public:
    BoxChurn(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts)
        : m_random(seed),
          m_chooser(circumstances.seed ^ seed),
          m_counts(counts),
          m_mistake(circumstances.mistake),
          m_margin(m_random.chance(0.3f) ? 0.0f : m_random.between(0, 0.3f)),
          m_pairs(m_margin)
    {
        // Many small worlds, some of a few hundred boxes, and seldom some thousand.
        const std::uint32_t size = m_random.below(40);
        m_target = size < 28   ? 3 + m_random.below(60)
                   : size < 39 ? 60 + m_random.below(340)
                               : 1000 + m_random.below(2000);
        m_side = 2.0f * std::cbrt(static_cast<float>(m_target)) * m_random.between(0.3f, 1.5f);
        const float far[] = {0, 0, 0, 1e3f, 1e5f};
        m_centre = toVector(m_random.point(-1, 1)) * btScalar(far[m_random.below(5)]);
        m_hasMixedSizes = m_random.chance(0.3f);
        makeBroadphase();
    }
    ~BoxChurn()
    {
        for (btBroadphaseProxy* const proxy : m_proxies)
            m_outer->destroyProxy(proxy, nullptr);
    }
    BoxChurn(const BoxChurn&) = delete;
    BoxChurn& operator=(const BoxChurn&) = delete;

    void run()
    {
        const int steps = 20 + static_cast<int>(m_random.below(isSmall() ? 200 : 40));
        while (m_proxies.size() < m_target)
            create();
        bool wasChecked = false;
        for (m_step = 0; m_step < steps; ++m_step)
        {
            const bool isOther = change();
            update();
            if (m_mistake == SoakMistake::Leak)
                m_leak = new char[100];
            ++m_counts.steps;
            const bool isChecked = isSmall() || m_random.chance(0.2f);
            if (isChecked)
            {
                const bool loses = m_mistake == SoakMistake::LostPair && ++m_checked == 40;
                m_pairs.check(m_step, m_proxies, *m_outer->getOverlappingPairCache(),
                              wasChecked && !m_hasNewIds, m_counts, loses);
                checkQuery();
            }
            m_hasNewIds = false;
            wasChecked = isChecked;
            const BroadphaseStats stats = m_broadphase->stats();
            m_totals.check(m_step, stats);
            m_totals.check(m_step, stats.backend, isOther);
        }
        finishRecording();
    }

private:
    bool isSmall() const { return m_target < 130; }

    void makeBroadphase()
    {
        BroadphaseOptions options;
        options.margin = btScalar(m_margin);
        options.threads = 1 + static_cast<int>(m_chooser.below(3));
        if (m_random.chance(0.15f))
            m_cache = std::make_unique<btHashedOverlappingPairCache>();
        m_broadphase = isSmall()
                           ? std::make_unique<Broadphase>(drawBackend(m_chooser), m_cache.get(), options)
                           : std::make_unique<Broadphase>(m_cache.get(), options);
        m_outer = m_broadphase.get();
#if defined(CULLET_SOAK_RECORDS)
        if (!m_random.chance(0.1f))
            return;
        m_path = "/tmp/cullet-soak-" + std::to_string(getpid()) + "-" +
                 std::to_string(reinterpret_cast<std::uintptr_t>(this)) + ".cbx";
        m_recorder = std::make_unique<RecordingBroadphase>(*m_broadphase, m_path);
        m_outer = m_recorder.get();
#endif
    }

    void finishRecording()
    {
#if defined(CULLET_SOAK_RECORDS)
        if (!m_recorder)
            return;
        if (!m_recorder->finish())
            throw SoakFault(m_step, m_recorder->error());
        std::string why;
        const auto reader = BoxStreamReader::open(m_path, why);
        std::uint64_t frames = 0;
        BoxEvent event;
        while (reader && reader->next(event) == BoxStreamReader::Next::Event)
            frames += event.kind == BoxEvent::Kind::Frame;
        std::remove(m_path.c_str());
        if (frames != m_recorder->frames())
            throw SoakFault(m_step, "a recording of " + std::to_string(m_recorder->frames()) +
                                        " frames has " + std::to_string(frames) + " " + why);
        m_counts.recordedFrames += frames;
#endif
    }

    /// On a thread that ends with it, at times.
    void update()
    {
        if (m_chooser.chance(0.01f))
            std::thread([this] { m_outer->calculateOverlappingPairs(nullptr); }).join();
        else
            m_outer->calculateOverlappingPairs(nullptr);
    }

    /// @return whether another backend has come
    bool change()
    {
        switch (m_random.below(24))
        {
            case 0:
                refill();
                break;
            case 1:
                moveSome(1, m_side);  // all teleport
                break;
            case 2:
                spoil();
                break;
            case 3:
            case 4:
                break;  // all rest
            case 5:
            case 6:
            case 7:
                moveSome(0.1f, 0.2f);
                break;
            default:
                moveSome(1, m_random.chance(0.5f) ? 0.01f : 0.4f);
                break;
        }
        for (std::uint32_t i = m_random.below(5); i > 0 && !m_proxies.empty() && m_random.chance(0.4f); --i)
            destroy(m_random.below(static_cast<std::uint32_t>(m_proxies.size())));
        while (m_proxies.size() < m_target && m_random.chance(0.7f))
            create();
        if (!isSmall() || !m_chooser.chance(0.02f))
            return false;
        m_broadphase->setBackend(drawBackend(m_chooser));
        return true;
    }

    void create()
    {
        const btVector3 min = m_centre + toVector(m_random.point(-0.5f, 0.5f)) * btScalar(m_side);
        const int group = 1 << m_random.below(3), mask = m_random.chance(0.8f) ? -1 : ~group;
        m_proxies.push_back(m_outer->createProxy(min, min + drawSize(), 0, &m_client, group, mask, nullptr));
    }
    btVector3 drawSize()
    {
        const btVector3 size = toVector(m_random.point(0, 1.5f));
        return m_hasMixedSizes ? size * btScalar(m_random.logUniform(-6, 4)) : size;
    }
    void destroy(std::size_t index)
    {
        m_outer->destroyProxy(m_proxies[index], nullptr);
        m_proxies[index] = m_proxies.back();
        m_proxies.pop_back();
    }

    /// Every box is destroyed, and the pool reset; others come.
    void refill()
    {
        while (!m_proxies.empty())
            destroy(m_proxies.size() - 1);
        if (m_random.chance(0.5f))
            update();
        if (m_random.chance(0.7f))
            m_outer->resetPool(nullptr);
        m_hasNewIds = true;
        while (m_proxies.size() < m_target)
            create();
    }

    void moveSome(float part, float stride)
    {
        for (btBroadphaseProxy* const proxy : m_proxies)
        {
            if (!m_random.chance(part))
                continue;
            const btVector3 by = toVector(m_random.point(-1, 1)) * btScalar(stride);
            btVector3 min = proxy->m_aabbMin + by, max = proxy->m_aabbMax + by;
            // Back to the others, or out of a box that is none.
            if (!((min - m_centre).length() < btScalar(2 * m_side)) ||
                !((max - min).length() < btScalar(1e4)))
            {
                min = m_centre + toVector(m_random.point(-0.5f, 0.5f)) * btScalar(m_side);
                max = min + drawSize();
            }
            m_outer->setAabb(proxy, min, max, nullptr);
        }
    }

    /// Boxes with a NaN, inverted, or as large as the world.
    void spoil()
    {
        for (btBroadphaseProxy* const proxy : m_proxies)
        {
            if (!m_random.chance(0.05f))
                continue;
            btVector3 min = proxy->m_aabbMin, max = proxy->m_aabbMax;
            const std::uint32_t kind = m_random.below(3);
            if (kind == 0)
                min[1] = std::numeric_limits<btScalar>::quiet_NaN();
            else if (kind == 1)
                std::swap(min, max);
            else
                max += btVector3(1, 1, 1) * btScalar(m_side);
            m_outer->setAabb(proxy, min, max, nullptr);
        }
    }

    void checkQuery()
    {
        if (!m_random.chance(0.2f))
            return;
        const btVector3 min = m_centre + toVector(m_random.point(-0.5f, 0.5f)) * btScalar(m_side);
        const btVector3 max = min + toVector(m_random.point(0, 3));
        Query query;
        m_outer->aabbTest(min, max, query);
        std::vector<int> expected;
        for (const btBroadphaseProxy* const proxy : m_proxies)
        {
            bool meets = true;
            for (int axis = 0; axis < 3; ++axis)
                meets &= proxy->m_aabbMin[axis] <= max[axis] && min[axis] <= proxy->m_aabbMax[axis] &&
                         proxy->m_aabbMin[axis] <= proxy->m_aabbMax[axis];
            if (meets)
                expected.push_back(proxy->m_uniqueId);
        }
        std::sort(expected.begin(), expected.end());
        if (query.ids != expected)
            throw SoakFault(m_step, "a query of a box reports " + std::to_string(query.ids.size()) +
                                        " proxies instead of " + std::to_string(expected.size()));
    }

    Random m_random;   ///< of the world
    Random m_chooser;  ///< of what changes nothing
    SoakCounts& m_counts;
    SoakMistake m_mistake;
    float m_margin, m_side = 1;
    SoakPairs m_pairs;
    SoakTotals m_totals;
    std::uint32_t m_target = 0;
    btVector3 m_centre;
    bool m_hasMixedSizes = false, m_hasNewIds = false;
    int m_step = 0, m_checked = 0;
    char* m_leak = nullptr;  ///< of SoakMistake::Leak
    btCollisionObject m_client;
    std::unique_ptr<btHashedOverlappingPairCache> m_cache;
    std::unique_ptr<Broadphase> m_broadphase;
#if defined(CULLET_SOAK_RECORDS)
    std::string m_path;
    std::unique_ptr<RecordingBroadphase> m_recorder;
#endif
    btBroadphaseInterface* m_outer = nullptr;  ///< what the world calls
    std::vector<btBroadphaseProxy*> m_proxies;
};
}  // namespace

void soakBoxes(std::uint32_t seed, const SoakCircumstances& circumstances, SoakCounts& counts)
{
    BoxChurn(seed, circumstances, counts).run();
    ++counts.worlds;
}
}  // namespace cullet::test
