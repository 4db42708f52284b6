// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/small_world_backend.h"

#include "cullet/base/trim_capacity.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/pairs/pair_tests.h"
#include "cullet/broad/pairs/restart_rows.h"

#include <algorithm>
#include <limits>
#include <new>

namespace cullet
{
void SmallWorldBackend::restart(const Pairs& known)
{
    m_known = known;
    m_isRestarted = true;
}

Status SmallWorldBackend::update(const ProxyView& proxies, PairDelta& delta)
try
{
    // By the changes of the last update.
    trimCapacity(m_added);
    trimCapacity(m_removed);
    m_added.clear();
    m_removed.clear();
    updateOrThrow(proxies);
    if (m_added.empty() && m_removed.empty())
    {
        delta.clear();
        return Status::Ok;
    }
    m_keySort.write(m_added, delta.added);
    m_keySort.write(m_removed, delta.removed);
    m_stats.pairs += delta.added.size();
    m_stats.pairs -= delta.removed.size();
    return Status::Ok;
}
catch (const std::bad_alloc&)
{
    delta.clear();
    m_isRestarted = true;
    return Status::OutOfMemory;
}

void SmallWorldBackend::updateOrThrow(const ProxyView& view)
{
    // A new filter or margin affects pairs of unmoved boxes too.
    const bool isRestarted = m_isRestarted;
    const bool areRulesNew = m_hadFilter != (view.filters != nullptr) || m_margin != view.margin;
    m_stats.candidates = 0;
    makeRoom(view.size);
    if (!m_isRestarted && !areRulesNew && view.dirtyCount == 0)
    {
        m_stats.path = "idle";
    }
    else if (m_isRestarted)
    {
        m_stats.path = "flat restart";
        restoreKnown(view);
        m_skins.turnOff();
        updateAll(view);
        m_isRestarted = false;
    }
    else if (!m_skins.isOn() || areRulesNew || !updateInsideSkins(view))
    {
        m_stats.path = "flat";
        if (areRulesNew)
            updateAll(view);
        else
            updateChanged(view);
        if (m_skins.isOn() ? m_skins.areWorthRenewing(view) : m_skins.isCalm(view))
            makeSkins(view);
        else if (m_skins.isOn())
            m_skins.turnOff();
    }
    m_hadFilter = view.filters != nullptr;
    m_margin = view.margin;
    const bool mayHaveNewIds =
        view.anyChanges == 0 ? view.dirtyCount != 0 : (view.anyChanges & (kRowCreated | kRowDestroyed)) != 0;
    if (isRestarted || mayHaveNewIds)
        m_ids.assign(view.uniqueIds, view.uniqueIds + view.size);
}

void SmallWorldBackend::updateChanged(const ProxyView& view)
{
    if (view.size <= kFewRows)
        return updateFew(view);
    // Half as many tests for each row, since none is tested against those before it.
    if (2 * view.dirtyCount > view.size)
        return updateAll(view);
    loadChanged(view);
    const bool areFew = m_moving.add(view);
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        if (areFew)
            updateMoving(view, m_moving.of(view.dirty[i]));
        else
            updateRow(view, view.dirty[i], 0);
    }
}

/// Tests a row that moves against its neighbours, for which it gets a list, and the other rows that move.
void SmallWorldBackend::updateMoving(const ProxyView& view, MovingRows::Row& moving)
{
    const bool isInside = MovingRows::isInsideSkin(view, moving);
    const bool hasList = isInside || (MovingRows::beginList(view, moving) && makeList(view, moving));
    moving.box = view.boxes[moving.row];
    if (!hasList)
        return updateRow(view, moving.row, 0);
    for (const std::uint32_t other : moving.near)
        updatePair(view, moving.row, other);
    for (const MovingRows::Row& other : m_moving.rows())
    {
        if (other.row != moving.row)
            updatePair(view, moving.row, other.row);
    }
    m_stats.candidates += moving.near.size() + m_moving.rows().size() - 1;
}

/// Lists the rows that a box may meet inside its skin; returns false if they are too many.
bool SmallWorldBackend::makeList(const ProxyView& view, MovingRows::Row& moving)
{
    const std::uint32_t row = moving.row;
    m_kernels.findOverlaps({m_limits.data(), m_stride, view.size}, row, moving.skin.growth(), 0,
                           m_found.data());
    m_found[row / 64] &= ~(std::uint64_t{1} << row % 64);
    for (std::uint32_t word = 0; word < m_stride / 64; ++word)
    {
        // The margin may hold a pair beyond the skin.
        std::uint64_t near = m_found[word] | heldOf(row)[word];
        for (; near != 0; near &= near - 1)
            moving.near.push_back(64 * word + static_cast<std::uint32_t>(__builtin_ctzll(near)));
    }
    m_stats.candidates += m_stride;
    if (moving.near.size() <= MovingRows::kMostNear)
        return true;
    MovingRows::endLongList(moving);
    return false;
}

/// Updates the pair of a valid box.
inline void SmallWorldBackend::updatePair(const ProxyView& view, std::uint32_t row, std::uint32_t other)
{
    if (overlapsBranchless(view.boxes[row], view.boxes[other]) != isHeld(row, other))
        examine(view, row, other);
}

void SmallWorldBackend::updateAll(const ProxyView& view)
{
    m_moving.clear();
    m_isStale = true;
    loadChanged(view);
    // The rows before this one have been tested against it already.
    for (std::uint32_t row = 0; row < view.size; ++row)
        updateRow(view, row, row / 64);
}

namespace
{
/// Some boxes in registers' order; the limits of an invalid one are NaN, so that it overlaps none.
struct FewBoxes
{
    void add(std::uint32_t row, const Aabb& box) noexcept
    {
        constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
        const Float4 low = minimaOf(box), high = maximaOf(box);
        minima[row] = isTrueInAll(low <= high) ? low : Float4{kNothing, kNothing, kNothing, kNothing};
        maxima[row] = high;
    }
    /// Bit i: whether a box overlaps row i, for the rows from `first` to before `end`.
    std::uint64_t overlapsOf(std::uint32_t row, std::uint32_t first, std::uint32_t end) const noexcept
    {
        const Float4 low = minima[row], high = maxima[row];
        std::uint64_t found = 0;
        for (std::uint32_t other = first; other < end; ++other)
        {
            const bool overlaps = isTrueInAll((low <= maxima[other]) & (minima[other] <= high));
            found |= std::uint64_t{overlaps} << other;
        }
        return found;
    }

    // Not initialised: most worlds fill a part.
    Float4 minima[SmallWorldBackend::kFewRows], maxima[SmallWorldBackend::kFewRows];
};
}  // namespace

/// Tests the changed boxes of a few one by one: to keep them in the arrays would take longer.
void SmallWorldBackend::updateFew(const ProxyView& view)
{
    m_isStale = true;
    FewBoxes boxes;
    for (std::uint32_t row = 0; row < view.size; ++row)
        boxes.add(row, view.boxes[row]);
    // As updateAll() does, or as updateChanged().
    const bool testsAll = 2 * view.dirtyCount > view.size;
    const std::uint32_t count = testsAll ? view.size - 1 : view.dirtyCount;
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint32_t row = testsAll ? i : view.dirty[i];
        const std::uint32_t first = testsAll ? row + 1 : 0;
        const std::uint64_t own = std::uint64_t{1} << row;
        const std::uint64_t before = (std::uint64_t{1} << first) - 1;
        const std::uint64_t held = *heldOf(row) & ~before;
        examineAll(view, row, 0, (boxes.overlapsOf(row, first, view.size) ^ held) & ~own);
        m_stats.candidates += view.size - first;
    }
}

/// Returns false, with no pair updated, when skins do not pay any more.
bool SmallWorldBackend::updateInsideSkins(const ProxyView& view)
{
    if (!m_skins.update(view))
        return false;
    m_stats.path = "flat in shells";
    m_moving.clear();
    if (m_skins.awake().empty())
        m_isStale |= view.dirtyCount != 0;
    else
        loadChanged(view);
    for (const std::uint32_t row : m_skins.awake())
        updateRow(view, row, 0);
    m_skins.pairs().updateChangeable(m_pairKernels, view, m_skins.references(),
                                     [&](RowPair pair, bool /*isHeld*/) { change(view, pair); });
    m_stats.candidates += m_skins.pairs().size();
    return true;
}

void SmallWorldBackend::makeSkins(const ProxyView& view)
{
    m_skins.begin(view);
    if (m_isStale)
        loadChanged(view);
    for (std::uint32_t row = 0; row < view.size; ++row)
    {
        m_kernels.findOverlaps({m_limits.data(), m_stride, view.size}, row, m_skins.pairGap(), row / 64,
                               m_found.data());
        for (std::uint32_t word = row / 64; word < m_stride / 64; ++word)
        {
            std::uint64_t near = m_found[word] | heldOf(row)[word];
            for (; near != 0; near &= near - 1)
            {
                const std::uint32_t other = 64 * word + static_cast<std::uint32_t>(__builtin_ctzll(near));
                if (other > row)
                    m_skins.addPair(view, {row, other}, isHeld(row, other));
            }
        }
    }
}

void SmallWorldBackend::loadChanged(const ProxyView& view)
{
    if (!m_isStale)
    {
        for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
            load(view, view.dirty[i]);
        return;
    }
    for (std::uint32_t row = 0; row < view.size; ++row)
        load(view, row);
    m_isStale = false;
}

/// Enlarges the arrays and the matrix, and keeps their contents.
void SmallWorldBackend::makeRoom(std::uint32_t rows)
{
    if (rows <= m_stride)
        return;
    const std::uint32_t stride = (rows + 63) / 64 * 64;
    std::vector<float> limits(6 * std::size_t{stride}, std::numeric_limits<float>::quiet_NaN());
    std::vector<std::uint64_t> held(std::size_t{stride} * (stride / 64));
    m_found.resize(stride / 64);
    for (std::uint32_t limit = 0; limit < 6; ++limit)
        std::copy_n(m_limits.begin() + limit * m_stride, m_stride, limits.begin() + limit * stride);
    for (std::uint32_t row = 0; row < m_stride; ++row)
        std::copy_n(heldOf(row), m_stride / 64, held.begin() + row * (stride / 64));
    m_limits.swap(limits);
    m_held.swap(held);
    m_stride = stride;
}

void SmallWorldBackend::restoreKnown(const ProxyView& view)
{
    std::fill(m_limits.begin(), m_limits.end(), std::numeric_limits<float>::quiet_NaN());
    std::fill(m_held.begin(), m_held.end(), 0);
    std::vector<RowPair> held;
    splitKnown(m_known, view, held, m_removed);
    for (const RowPair pair : held)
        flip(pair.a, pair.b);
    m_stats.pairs = m_known.size();
}

void SmallWorldBackend::load(const ProxyView& view, std::uint32_t row)
{
    const Aabb& box = view.boxes[row];
    const bool valid = isValid(box);
    for (std::uint32_t axis = 0; axis < 3; ++axis)
    {
        // NaN rather than the empty box: the empty box's infinities would pass the test against an infinite box.
        constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
        m_limits[2 * axis * m_stride + row] = valid ? box.min[axis] : kNothing;
        m_limits[(2 * axis + 1) * m_stride + row] = valid ? box.max[axis] : kNothing;
    }
}

void SmallWorldBackend::updateRow(const ProxyView& view, std::uint32_t row, std::uint32_t firstWord)
{
    m_kernels.findOverlaps({m_limits.data(), m_stride, view.size}, row, 0.0f, firstWord, m_found.data());
    m_found[row / 64] &= ~(std::uint64_t{1} << row % 64);
    const std::uint32_t words = m_stride / 64;
    for (std::uint32_t word = firstWord; word < words; ++word)
        examineAll(view, row, word, m_found[word] ^ heldOf(row)[word]);
    m_stats.candidates += 64 * (words - firstWord);
}

/// Examines the pairs of the row with the rows of a word, one for each bit that is set.
inline void SmallWorldBackend::examineAll(const ProxyView& view, std::uint32_t row, std::uint32_t word,
                                          std::uint64_t bits)
{
    for (; bits != 0; bits &= bits - 1)
        examine(view, row, 64 * word + static_cast<std::uint32_t>(__builtin_ctzll(bits)));
}

/// Updates a pair that overlaps and is not held, or is held and does not overlap.
void SmallWorldBackend::examine(const ProxyView& view, std::uint32_t row, std::uint32_t other)
{
    const Aabb& a = view.boxes[row];
    const Aabb& b = view.boxes[other];
    const bool held = isHeld(row, other);
    const bool areValid = isValid(a) && isValid(b);
    if (held ? areValid && overlapsWithMargin(a, b, view.margin) : !areValid)
        return;
    if (held || mayEnter(view, {row, other}))
        change(view, {row, other});
}

/// The pair enters the pair set or leaves it.
void SmallWorldBackend::change(const ProxyView& view, RowPair pair)
{
    (isHeld(pair.a, pair.b) ? m_removed : m_added).push_back(idsOf(view, pair));
    flip(pair.a, pair.b);
}

void SmallWorldBackend::flip(std::uint32_t row, std::uint32_t other)
{
    heldOf(row)[other / 64] ^= std::uint64_t{1} << other % 64;
    heldOf(other)[row / 64] ^= std::uint64_t{1} << row % 64;
}

Pairs SmallWorldBackend::heldPairs() const
{
    if (m_isRestarted)
        return m_known;
    Pairs pairs;
    const std::size_t words = m_stride / 64;
    for (std::uint32_t row = 0; row < m_ids.size(); ++row)
    {
        for (std::size_t word = row / 64; word < words; ++word)
        {
            for (std::uint64_t bits = m_held[row * words + word]; bits != 0; bits &= bits - 1)
            {
                const std::size_t other = 64 * word + static_cast<std::size_t>(__builtin_ctzll(bits));
                if (other > row)
                    pairs.push_back(makePair(m_ids[row], m_ids[other]));
            }
        }
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

BackendStats SmallWorldBackend::stats() const
{
    BackendStats stats = m_stats;
    stats.entries = m_ids.size();
    stats.bytes = m_limits.capacity() * sizeof(float) +
                  (m_held.capacity() + m_found.capacity() + m_added.capacity() + m_removed.capacity()) *
                      sizeof(std::uint64_t) +
                  m_ids.capacity() * sizeof(std::uint32_t) + m_known.capacity() * sizeof(Pair) +
                  m_skins.bytes() + m_moving.bytes();
    return stats;
}
}  // namespace cullet
