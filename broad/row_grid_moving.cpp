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

/// Picks the new pairs from what the grid finds, in the threads of the grid.
class RowGridBackend::MovingSink final : public PairSink
{
public:
    MovingSink(const RowGridBackend& backend, const ProxyView& view, unsigned workers)
        : m_backend(backend), m_view(view), m_lists(workers)
    {
    }

    void take(unsigned worker, const IdPair* pairs, std::uint32_t count) override
    {
        for (std::uint32_t i = 0; i < count; ++i)
        {
            if (isNew(pairs[i]) && mayEnter(m_view, pairs[i]))
                m_lists[worker].added.push_back(pairs[i]);
        }
    }

    template <class Visit>
    void forEachAdded(Visit visit) const
    {
        for (const List& list : m_lists)
        {
            for (const IdPair pair : list.added)
                visit(pair);
        }
    }

private:
    struct alignas(64) List
    {
        std::vector<IdPair> added;
    };

    /// What overlapped in the last update was decided about then, or earlier: it is held, or the filter refused it.
    bool isNew(IdPair pair) const
    {
        const Aabb& a = m_backend.m_reference[pair.a];
        const Aabb& b = m_backend.m_reference[pair.b];
        if (isValid(a) && isValid(b) && overlapsBranchless(a, b))
            return false;
        return !m_backend.m_separated.contains(PairSet::keyOf(pair.a, pair.b));
    }

    const RowGridBackend& m_backend;
    const ProxyView& m_view;
    std::vector<List> m_lists;
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

/// Measures the gap of a held pair anew; false when the pair is to leave.
bool RowGridBackend::refreshGap(const ProxyView& view, HeldPair& held)
{
    const Aabb& a = view.boxes[held.ids.a];
    const Aabb& b = view.boxes[held.ids.b];
    if (!isValid(a) || !isValid(b))
        return false;
    held.gap = gapOf(a, b);
    if (overlapsBranchless(a, b))
        return true;
    if (!overlapsWithMargin(a, b, view.margin))
        return false;
    m_separated.insert(PairSet::keyOf(held.ids.a, held.ids.b));
    return true;
}

void RowGridBackend::keepOrRemove(const ProxyView& view, float motion)
{
    m_separated.reset(0);
    const float change = kMotionFactor * motion;
    std::size_t kept = 0;
    for (HeldPair held : m_pairs)
    {
        // The bound follows the motion, one step of its own precision farther, so that it is never absorbed.
        const float gap = held.gap + change;
        held.gap = gap + std::abs(gap) * std::numeric_limits<float>::epsilon();
        // Negated, so that an unknown gap (NaN) is measured.
        if (!(held.gap <= 0.0f) && !refreshGap(view, held))
            reportRemoved(view, held.ids);
        else
            m_pairs[kept++] = held;
    }
    m_pairs.resize(kept);
}

void RowGridBackend::updateMoving(const ProxyView& view)
{
    m_stats.path = view.dirtyCount == 0 ? "idle" : "rebuild";
    // The margin alone may have changed, so that held pairs that do not overlap are looked at even when nothing moved.
    if (view.dirtyCount == 0 && m_separated.isEmpty())
        return;
    const float motion = largestMotion(view);
    MovingSink sink(*this, view, m_workers.threads());
    m_grid.scan({view.boxes, nullptr, view.size, 0.0f, sureGap(motion)}, sink, false);
    ++m_stats.rebuildsTotal;

    keepOrRemove(view, motion);
    sink.forEachAdded(
        [&](IdPair pair)
        {
            reportAdded(view, pair);
            m_pairs.push_back({pair, gapOf(view.boxes[pair.a], view.boxes[pair.b])});
        });
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
        m_reference[view.dirty[i]] = view.boxes[view.dirty[i]];
}
}  // namespace cullet
