// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cullet::test
{
/// Thrown by callbacks of the application.
struct CallbackFailure : std::runtime_error
{
    CallbackFailure() : std::runtime_error("callback of the application") {}
};

/// An overlap filter whose answer depends on ids and maybe on groups, and which does something in one of its calls.
class PairFilter final : public btOverlapFilterCallback
{
public:
    /// @param allowed a pair passes if the bit with the pair's number from 0 to 15 is set: three of four pairs by default
    PairFilter(std::uint32_t seed, bool readsGroups, std::uint16_t allowed = 0xeeee)
        : m_seed(seed), m_readsGroups(readsGroups), m_allowed(allowed)
    {
    }

    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        const bool answer = answers(*a, *b);
        const Question question(m_questions, {a, b});
        if (onCall)
            onCall();
        return answer;
    }

    /// Whether a call for this pair runs.
    bool isAsked(const btBroadphaseProxy& a, const btBroadphaseProxy& b) const
    {
        const auto isOf = [&](const Proxies& proxies)
        { return proxies == Proxies(&a, &b) || proxies == Proxies(&b, &a); };
        return std::any_of(m_questions.begin(), m_questions.end(), isOf);
    }

    bool answers(const btBroadphaseProxy& first, const btBroadphaseProxy& second) const
    {
        if (m_readsGroups && first.m_collisionFilterGroup != second.m_collisionFilterGroup)
            return false;
        int a = first.m_uniqueId, b = second.m_uniqueId;
        if (a > b)
            std::swap(a, b);
        const std::uint32_t word =
            (static_cast<std::uint32_t>(a) * 2654435761u ^ static_cast<std::uint32_t>(b) * 40503u) + m_seed;
        return (m_allowed >> (word * 2246822519u >> 16) % 16 & 1) != 0;
    }

    std::function<void()> onCall;

private:
    using Proxies = std::pair<const btBroadphaseProxy*, const btBroadphaseProxy*>;

    /// Lives during a call.
    struct Question
    {
        Question(std::vector<Proxies>& all, const Proxies& proxies) : questions(all)
        {
            all.push_back(proxies);
        }
        ~Question() { questions.pop_back(); }
        Question(const Question&) = delete;
        Question& operator=(const Question&) = delete;

        std::vector<Proxies>& questions;
    };

    mutable std::vector<Proxies> m_questions;  ///< of the calls that run
    std::uint32_t m_seed;
    bool m_readsGroups;
    std::uint16_t m_allowed;
};
}  // namespace cullet::test
