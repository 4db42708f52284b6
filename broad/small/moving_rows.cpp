// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/moving_rows.h"

#include "cullet/broad/boxes/aabb_simd.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
namespace
{
constexpr float kStepsOfSkin = 8;  // for which a skin lasts in a straight line
constexpr std::uint32_t kPause = 16;

float largestSide(const Aabb& box) noexcept
{
    const Float4 extents = extentsOf(box);
    return std::max({extents[0], extents[1], extents[2]});
}

/// The largest motion of a face; NaN or infinite if one of them is or was nowhere.
float largestStep(const Aabb& from, const Aabb& to) noexcept
{
    float step = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        // Written so that a NaN stays.
        for (const float motion : {to.min[axis] - from.min[axis], to.max[axis] - from.max[axis]})
            step = std::abs(motion) <= step ? step : std::abs(motion);
    }
    return step;
}
}  // namespace

void MovingRows::clear() noexcept
{
    m_rows.clear();
    m_places.clear();
}

bool MovingRows::add(const ProxyView& view)
{
    if (view.size < kFewestRows || view.size < m_places.size())
    {
        clear();
        return false;
    }
    m_places.resize(view.size, kNone);
    const std::size_t most = std::min<std::size_t>(view.size / kMovingShare, kNone);
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if (m_places[row] != kNone)
            continue;
        if (m_rows.size() == most)
        {
            clear();
            return false;
        }
        // Where it was is unknown: it gets a list with its second step.
        m_rows.emplace_back();
        m_rows.back().row = row;
        m_places[row] = static_cast<std::uint8_t>(m_rows.size() - 1);
    }
    return true;
}

bool MovingRows::beginList(const ProxyView& view, Row& moving)
{
    const Aabb& box = view.boxes[moving.row];
    const float step = largestStep(moving.box, box);
    const float side = largestSide(box);
    moving.skin = kNoList;
    if (moving.pause != 0)
    {
        --moving.pause;
        return false;
    }
    // Written so that a NaN fails.
    if (!(view.changes[moving.row] == kRowMoved && step <= side / 2 &&
          side <= std::numeric_limits<float>::max()))
        return false;
    moving.skin.thickness = std::min(kStepsOfSkin * step, side);
    moving.reference = box;
    moving.near.clear();
    return true;
}

void MovingRows::endLongList(Row& moving) noexcept
{
    moving.skin = kNoList;
    moving.pause = kPause;
    moving.near.clear();
}

std::uint64_t MovingRows::bytes() const noexcept
{
    std::uint64_t sum = m_rows.capacity() * sizeof(Row) + m_places.capacity();
    for (const Row& moving : m_rows)
        sum += moving.near.capacity() * sizeof(std::uint32_t);
    return sum;
}
}  // namespace cullet
