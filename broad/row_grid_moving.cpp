// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_grid_backend.h"
#include "broad/row_grid_sinks.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cullet
{
namespace
{
// Gaps and motions are rounded differences; the factor covers both roundings many times over.
constexpr float kMotionFactor = 2.0001f;

/// Pairs with a gap up to this overlapped before and after a motion; NaN, which no gap is below, if nothing is sure.
float sureGap(float motion)
{
    const float gap = -kMotionFactor * motion;
    return std::isfinite(gap) ? gap : std::numeric_limits<float>::quiet_NaN();
}
}  // namespace

/// Sorts what the grid finds into pairs held before and new ones, in the threads of the grid.
class RowGridBackend::MovingSink final : public PairSink
{
public:
    MovingSink(const RowGridBackend& backend, const ProxyView& view, float motion, unsigned workers)
        : m_backend(backend), m_view(view), m_surelyHeld(sureGap(motion)), m_results(workers)
    {
    }

    void take(unsigned worker, const IdPair* pairs, std::uint32_t count) override
    {
        Result& result = m_results[worker];
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const IdPair pair = pairs[i];
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            if (!m_backend.mayEnter(m_view, pair) && !m_backend.m_exempt.contains(key))
                continue;
            const float gap = gapOf(m_view.boxes[pair.a], m_view.boxes[pair.b]);
            result.pairs.push_back({pair, gap});
            if (gap <= m_surelyHeld || wasHeld(pair, key))
                continue;
            result.added.push_back(pair);
        }
    }

    struct alignas(64) Result
    {
        std::vector<HeldPair> pairs;
        std::vector<IdPair> added;
    };

    const std::vector<Result>& results() const { return m_results; }

private:
    bool wasHeld(IdPair pair, std::uint64_t key) const
    {
        const Aabb& a = m_backend.m_reference[pair.a];
        const Aabb& b = m_backend.m_reference[pair.b];
        if (isValid(a) && isValid(b) && overlaps(a, b))
            return true;
        return m_backend.m_separated.contains(key);
    }

    const RowGridBackend& m_backend;
    const ProxyView& m_view;
    float m_surelyHeld;
    std::vector<Result> m_results;
};

/// How far any face of any box moved since the last update; infinite when a box came, went, or became empty.
float RowGridBackend::largestMotion(const ProxyView& view) const
{
    // Floats without sign order like their bits; infinity and NaN, the motion of boxes that were or are empty, come
    // out on top. An integer maximum needs no branches and vectorises.
    std::int32_t largest = 0;
    std::uint8_t changes = 0;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        changes = static_cast<std::uint8_t>(changes | view.changes[row]);
        float motion[6];
        for (int axis = 0; axis < 3; ++axis)
        {
            motion[axis] = view.boxes[row].min[axis] - m_reference[row].min[axis];
            motion[axis + 3] = view.boxes[row].max[axis] - m_reference[row].max[axis];
        }
        std::int32_t bits[6];
        std::memcpy(bits, motion, sizeof bits);
        for (const std::int32_t b : bits)
            largest = std::max(largest, b & 0x7fffffff);
    }
    float result;
    std::memcpy(&result, &largest, sizeof result);
    const bool cameOrWent = (changes & (kRowCreated | kRowDestroyed)) != 0;
    return cameOrWent || !(result < std::numeric_limits<float>::infinity())
               ? std::numeric_limits<float>::infinity()
               : result;
}

void RowGridBackend::keepOrRemoveOld(const ProxyView& view, float motion, std::vector<HeldPair>& next)
{
    const float surelyOverlapping = sureGap(motion);
    m_separated.reset(0);
    for (const HeldPair& held : m_pairs)
    {
        // Found again by the grid, and so in `next` already.
        if (held.gap <= surelyOverlapping)
            continue;
        const Aabb& a = view.boxes[held.ids.a];
        const Aabb& b = view.boxes[held.ids.b];
        const bool valid = isValid(a) && isValid(b);
        if (valid && overlaps(a, b))
            continue;
        if (valid && overlapsWithMargin(a, b, view.margin))
        {
            m_separated.insert(PairSet::keyOf(held.ids.a, held.ids.b));
            next.push_back({held.ids, std::numeric_limits<float>::infinity()});
        }
        else
        {
            reportRemoved(view, held.ids);
        }
    }
}

void RowGridBackend::updateMoving(const ProxyView& view)
{
    m_stats.path = view.dirtyCount == 0 ? "idle" : "rebuild";
    // The margin alone may have changed, so that held pairs that do not overlap are looked at even when nothing moved.
    if (view.dirtyCount == 0 && m_separated.isEmpty())
        return;
    const float motion = largestMotion(view);
    MovingSink sink(*this, view, motion, m_workers.threads());
    m_grid.scan({view.boxes, nullptr, view.size, 0.0f}, sink, false);
    ++m_stats.rebuildsTotal;

    std::size_t total = 0;
    for (const MovingSink::Result& result : sink.results())
        total += result.pairs.size();
    std::vector<HeldPair> next;
    next.reserve(total + m_pairs.size() / 8);
    for (const MovingSink::Result& result : sink.results())
    {
        next.insert(next.end(), result.pairs.begin(), result.pairs.end());
        for (const IdPair pair : result.added)
            reportAdded(view, pair);
    }
    keepOrRemoveOld(view, motion, next);
    m_pairs.swap(next);
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
        m_reference[view.dirty[i]] = view.boxes[view.dirty[i]];
}
}  // namespace cullet
