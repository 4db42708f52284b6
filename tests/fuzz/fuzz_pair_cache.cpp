// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Calls of a pair cache, and calls from within their callbacks, compared with a std::map.

#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/pair_cache_twin.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
const char* const kFuzzTargetName = "pair_cache";

namespace
{
constexpr std::uint32_t kProxyCount = 14;
constexpr int kDeepest = 4;

enum class Call
{
    None,
    Add,
    Remove,
    RemoveOf,
    Clean,
    CleanPair,
    Find,
    Sort,
    Process,
    ProcessInOrder,
    RemoveCurrent,
    AddCurrent,
    RemoveOfCurrent,
    Reserve,
    AddMany,
    RemoveMany,
    kCount
};

/// A call that is made in one of the next callbacks.
struct NestedCall
{
    Call call;
    std::uint32_t delay;  ///< callbacks before it
    std::size_t a, b;
};

class PairCacheRun
{
public:
    PairCacheRun(const std::uint8_t* data, std::size_t size)
        : m_choices(data, size), m_twin(m_proxies, !m_choices.chance(64))
    {
        const int firstId = m_choices.of({1, 0x7ffffff8, -6, 1000000});
        for (std::uint32_t i = 0; i < kProxyCount; ++i)
            m_proxies.add(idAfter(i == 0 ? firstId - 1 : m_proxies[i - 1]->m_uniqueId, 1));
        m_lastId = m_proxies[kProxyCount - 1]->m_uniqueId;
        m_twin.onCallback = [this](RowPair ids) { callNested(ids); };
    }

    std::string run()
    {
        for (m_choices.nextOperation(); !m_choices.isEmpty() && m_twin.fault().empty();
             m_choices.nextOperation())
            operate();
        m_nested.clear();
        for (std::uint32_t i = 0; i < kProxyCount && m_twin.fault().empty(); ++i)
            m_twin.removeOf(i);
        m_twin.check();
        return m_twin.fault();
    }

private:
    enum class Special
    {
        UseFilter = static_cast<int>(Call::kCount),
        ChangeWords,
        ReplaceProxy,
        AddRing,
        kCount
    };

    void operate()
    {
        const std::uint32_t kind = m_choices.below(static_cast<std::uint32_t>(Special::kCount));
        const std::size_t a = m_choices.below(kProxyCount);
        const std::size_t b = m_choices.below(kProxyCount);
        m_flags = m_choices.byte();
        m_share = m_choices.byte();
        m_nested.clear();
        for (int i = 0; i < 3; ++i)
            readNested();
        if (kind < static_cast<std::uint32_t>(Call::kCount))
            call(static_cast<Call>(kind), a, b, {m_proxies[a]->m_uniqueId, m_proxies[b]->m_uniqueId});
        else
            change(static_cast<Special>(kind), a);
        m_nested.clear();
        m_twin.check();
    }

    void readNested()
    {
        const std::uint8_t bits = m_choices.byte();
        const std::size_t a = m_choices.below(kProxyCount);
        const std::size_t b = m_choices.below(kProxyCount);
        const Call call = static_cast<Call>(bits % 16);
        if (call != Call::None)
            m_nested.push_back({call, bits / 16u % 8, a, b});
    }

    void change(Special kind, std::size_t a)
    {
        if (kind == Special::UseFilter)
        {
            m_twin.setLinked((m_flags & 16) == 0);
            return m_twin.useFilter((m_flags & 1) != 0);
        }
        if (kind == Special::AddRing)
        {
            for (std::size_t i = 0; i < kProxyCount; ++i)
                m_twin.add(i, (i + 1 + m_share % 12) % kProxyCount, (m_flags & 1) != 0);
            return;
        }
        if (kind == Special::ChangeWords)
        {
            m_proxies[a]->m_collisionFilterGroup = (m_flags & 1) != 0 ? 2 : 1;
            m_proxies[a]->m_collisionFilterMask = (m_flags & 2) != 0 ? ~2 : -1;
            return;
        }
        m_nested.clear();
        m_twin.removeOf(a);
        m_lastId = idAfter(m_lastId, 1 + m_flags % 4 * (1 << 20));
        m_proxies[a]->m_uniqueId = m_lastId;
    }

    /// As Bullet counts them, past the end of int too.
    static int idAfter(int id, int step)
    {
        const auto next = static_cast<std::uint32_t>(id) + static_cast<std::uint32_t>(step);
        return static_cast<int>(next == 0 ? 1u : next);
    }

    std::size_t rowOf(int id)
    {
        for (std::size_t row = 0; row < kProxyCount; ++row)
            if (m_proxies[row]->m_uniqueId == id)
                return row;
        return 0;
    }

    void callNested(RowPair ids)
    {
        if (m_nested.empty() || m_depth == kDeepest)
            return;
        if (m_nested.back().delay-- > 0)
            return;
        const NestedCall nested = m_nested.back();
        m_nested.pop_back();
        ++m_depth;
        call(nested.call, nested.a, nested.b, ids);
        --m_depth;
    }

    std::vector<std::pair<std::size_t, std::size_t>> manyRows(std::size_t a, std::size_t b) const
    {
        std::vector<std::pair<std::size_t, std::size_t>> rows;
        constexpr std::uint8_t kAll = 0xf0;
        for (std::size_t i = 0; m_share >= kAll && i < kProxyCount; ++i)
            for (std::size_t k = i + 1; k < kProxyCount; ++k)
                rows.push_back({i, k});
        if (m_share >= kAll)
            return rows;
        for (std::size_t i = 0; i < m_share % 16u; ++i)
            rows.push_back({(a + i) % kProxyCount, (b + i * i) % kProxyCount});
        return rows;
    }

    /// @param ids of the callback's pair
    void call(Call which, std::size_t a, std::size_t b, RowPair ids)
    {
        // Whether a visited pair goes depends on its number only, so that nested passes need no order.
        const auto goes = [this](std::uint64_t serial)
        { return (serial * 2654435761u >> 7) % 256 < m_share; };
        const bool flag = (m_flags & 1) != 0;
        const bool hasDispatcher = (m_flags & 6) != 6;
        switch (which)
        {
            case Call::Add:
                return m_twin.add(a, b, flag);
            case Call::Remove:
                return m_twin.remove(a, b, flag, hasDispatcher);
            case Call::RemoveOf:
                return m_twin.removeOf(a);
            case Call::Clean:
                return m_twin.clean(a, hasDispatcher);
            case Call::CleanPair:
                return m_twin.cleanPair(a, b);
            case Call::Find:
                return m_twin.find(a, b);
            case Call::Sort:
                return m_twin.sort();
            case Call::Process:
            case Call::ProcessInOrder:
                return m_twin.process(which == Call::ProcessInOrder, goes);
            case Call::RemoveCurrent:
                return m_twin.remove(rowOf(ids.second), rowOf(ids.first), flag, true);
            case Call::AddCurrent:
                return m_twin.add(rowOf(ids.second), rowOf(ids.first), flag);
            case Call::RemoveOfCurrent:
                return m_twin.removeOf(rowOf((m_flags & 8) != 0 ? ids.first : ids.second));
            case Call::Reserve:
                m_twin.setLinked((m_flags & 32) == 0);
                return m_twin.reserve(m_share * std::size_t{8});
            case Call::AddMany:
                return m_twin.addMany(manyRows(a, b));
            case Call::RemoveMany:
                return m_twin.removeMany(manyRows(a, b));
            default:
                return;
        }
    }

    Choices m_choices;
    Proxies m_proxies;
    PairCacheTwin m_twin;
    std::vector<NestedCall> m_nested;
    std::uint8_t m_flags = 0;
    std::uint8_t m_share = 0;
    int m_depth = 0;
    int m_lastId = 0;
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    return PairCacheRun(data, size).run();
}
}  // namespace cullet::test
