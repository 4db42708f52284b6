// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/box_model.h"
#include "cullet/tests/fuzz/c_interface/call_check.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/support/random.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
/// Calls of one box set, and a model of it.
class BoxSetCalls
{
public:
    explicit BoxSetCalls(CallCheck& check) : m_check(check)
    {
        Choices none(nullptr, 0);
        create(none);
    }
    BoxSetCalls(const BoxSetCalls&) = delete;
    BoxSetCalls& operator=(const BoxSetCalls&) = delete;
    ~BoxSetCalls() { cullet_box_set_destroy(m_set); }

    /// Destroys the set and makes another one, which may fail and leaves none then.
    void create(Choices& choices)
    {
        cullet_box_set_destroy(m_set);
        m_set = nullptr;
        m_model = {};
        m_nextId = 1;
        m_margin = 0;
        constexpr std::uint32_t kSize = sizeof(cullet_box_set_options);
        const std::uint32_t sizes[] = {kSize, kSize + 16, 0, kSize - 1};
        Faults faults;
        const bool hasOptions = !choices.chance(32);
        const std::uint32_t size = sizes[choices.chance(32) ? choices.below(4) : 0];
        Sized<cullet_box_set_options> options(size);
        // Without CUDA: machines differ in that.
        const std::int32_t backends[] = {CULLET_BACKEND_AUTO, CULLET_BACKEND_GRID, CULLET_BACKEND_BRUTE, 4,
                                         -1};
        const std::int32_t threads[] = {1, 2, 0, -1, 4097};
        options.known.backend = backends[choices.below(choices.chance(32) ? 5 : 3)];
        options.known.threads = threads[choices.below(choices.chance(32) ? 5 : 2)];
        options.known.margin = anyMargin(choices);
        if (choices.chance(16))
            options.later[choices.below(16)] = 1;
        const auto isSet = [](unsigned char byte) { return byte != 0; };
        const bool knowsLater = size > kSize && std::any_of(options.later, options.later + 16, isSet);
        if (hasOptions)
        {
            faults.add(size < kSize || knowsLater, CULLET_ERROR_SIZE);
            faults.add(options.known.backend < 0 || options.known.backend > 3, CULLET_ERROR_ARGUMENT);
            faults.add(options.known.threads < 0 || options.known.threads > 4096, CULLET_ERROR_ARGUMENT);
            faults.add(!(options.known.margin >= 0), CULLET_ERROR_ARGUMENT);
        }
        const bool hasOut = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        const cullet_status status =
            cullet_box_set_create(hasOptions ? &options.known : nullptr, hasOut ? &m_set : nullptr);
        if (m_check.expect("cullet_box_set_create()", status, faults) && hasOptions)
            m_margin = options.known.margin;
        m_check.require((m_set != nullptr) == !faults.any(), "cullet_box_set_create()",
                        "sets a wrong handle");
    }

    void add(Choices& choices)
    {
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        const bool isFull = m_model.live().size() > kMostBoxes;
        const std::uint32_t most = choices.chance(16) ? 120 : choices.below(6);
        const std::vector<Aabb> boxes = anyBoxes(choices, isFull ? 0 : most);
        const auto count = static_cast<std::uint32_t>(boxes.size());
        Strided strided(boxes, choices);
        bool hasBoxes = true, hasIds = true;
        std::uint32_t asked = count;
        if (count > 0)
        {
            faults.add(strided.isWrong(), CULLET_ERROR_SIZE);
            hasBoxes = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
            hasIds = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
            if (faults.add(choices.chance(8), CULLET_ERROR_ARGUMENT))
                asked = (1u << 30) + 1;
        }
        std::vector<std::uint32_t> ids(count + 1, kUnset);
        const cullet_status status =
            cullet_box_set_add(hasSet ? m_set : nullptr, hasBoxes ? strided.data() : nullptr,
                               strided.stride(), asked, hasIds ? ids.data() : nullptr);
        const cullet_status remark = areAllSolid(boxes) ? CULLET_OK : CULLET_EMPTY_BOXES;
        const bool isDone = m_check.expect("cullet_box_set_add()", status, faults, remark);
        for (std::uint32_t i = 0; i < count; ++i)
        {
            m_check.require(ids[i] == (isDone ? m_nextId : kUnset), "cullet_box_set_add()",
                            "returns another id");
            if (isDone)
                m_model.create(m_nextId - 1, m_nextId, boxes[i], {1, -1});
            m_nextId += isDone;
        }
        m_check.require(ids[count] == kUnset, "cullet_box_set_add()", "writes beyond the ids");
    }

    void move(Choices& choices)
    {
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        const std::vector<std::uint32_t> ids = anyIds(choices, faults);
        std::vector<Aabb> boxes = anyBoxes(choices, static_cast<std::uint32_t>(ids.size()));
        if (!faults.any() && choices.chance(96))
            stretch(ids, choices.below(6), boxes);
        Strided strided(boxes, choices);
        const bool isAny = !ids.empty();
        faults.add(isAny && strided.isWrong(), CULLET_ERROR_SIZE);
        const bool hasIds = !faults.add(isAny && choices.chance(8), CULLET_ERROR_NULL);
        const bool hasBoxes = !faults.add(isAny && choices.chance(8), CULLET_ERROR_NULL);
        const cullet_status status = cullet_box_set_move(
            hasSet ? m_set : nullptr, hasIds ? ids.data() : nullptr, hasBoxes ? strided.data() : nullptr,
            strided.stride(), static_cast<std::uint32_t>(ids.size()));
        const cullet_status remark = areAllSolid(boxes) ? CULLET_OK : CULLET_EMPTY_BOXES;
        if (!m_check.expect("cullet_box_set_move()", status, faults, remark))
            return;
        for (std::size_t i = 0; i < ids.size(); ++i)
            m_model.setBox(ids[i] - 1, boxes[i]);
    }

    void filter(Choices& choices)
    {
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        const std::vector<std::uint32_t> ids = anyIds(choices, faults);
        std::vector<cullet_filter> filters;
        for (std::size_t i = 0; i < ids.size(); ++i)
        {
            const std::int32_t group = static_cast<std::int32_t>(1u << choices.below(2));
            const std::int32_t masks[] = {-1, 0, 1, 2};
            filters.push_back({group, masks[choices.below(4)]});
        }
        const bool isAny = !ids.empty();
        const bool hasIds = !faults.add(isAny && choices.chance(8), CULLET_ERROR_NULL);
        const bool hasFilters = !faults.add(isAny && choices.chance(8), CULLET_ERROR_NULL);
        const cullet_status status = cullet_box_set_filter(
            hasSet ? m_set : nullptr, hasIds ? ids.data() : nullptr, hasFilters ? filters.data() : nullptr,
            static_cast<std::uint32_t>(ids.size()));
        if (!m_check.expect("cullet_box_set_filter()", status, faults))
            return;
        for (std::size_t i = 0; i < ids.size(); ++i)
            m_model.setFilter(ids[i] - 1, {filters[i].group, filters[i].mask});
    }

    void remove(Choices& choices)
    {
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        std::vector<std::uint32_t> ids = anyIds(choices, faults);
        std::vector<std::uint32_t> sorted = ids;
        std::sort(sorted.begin(), sorted.end());
        faults.add(std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end(), CULLET_ERROR_ID);
        const bool hasIds = !faults.add(!ids.empty() && choices.chance(8), CULLET_ERROR_NULL);
        const cullet_status status = cullet_box_set_remove(
            hasSet ? m_set : nullptr, hasIds ? ids.data() : nullptr, static_cast<std::uint32_t>(ids.size()));
        if (!m_check.expect("cullet_box_set_remove()", status, faults))
            return;
        for (const std::uint32_t id : ids)
        {
            const auto& live = m_model.live();
            m_model.destroy(
                static_cast<std::size_t>(std::find(live.begin(), live.end(), id - 1) - live.begin()));
        }
    }

    void update(Choices& choices)
    {
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        const bool hasAdded = !choices.chance(32), hasRemoved = !choices.chance(32);
        const cullet_pair sentinel = {7, 8};
        cullet_pairs added = {&sentinel, kUnset}, removed = added;
        const cullet_status status = cullet_box_set_update(
            hasSet ? m_set : nullptr, hasAdded ? &added : nullptr, hasRemoved ? &removed : nullptr);
        const bool isDone = m_check.expect("cullet_box_set_update()", status, faults);
        const bool isAddedSet = added.count != kUnset, isRemovedSet = removed.count != kUnset;
        m_check.require(isAddedSet == (isDone && hasAdded) && isRemovedSet == (isDone && hasRemoved),
                        "cullet_box_set_update()", "sets other results than asked for");
        if (!isDone || !m_check.fault().empty())
            return;
        const PairDelta delta = m_model.update(m_margin, true);
        m_check.require(!hasAdded || isSame(added, delta.added), "cullet_box_set_update()",
                        "adds other pairs");
        m_check.require(!hasRemoved || isSame(removed, delta.removed), "cullet_box_set_update()",
                        "removes other pairs");
        readPairs(choices);
    }

    void readPairs(Choices& choices)
    {
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        const bool hasPairs = !faults.add(choices.chance(4), CULLET_ERROR_NULL);
        cullet_pairs pairs = {nullptr, kUnset};
        const cullet_status status =
            cullet_box_set_pairs(hasSet ? m_set : nullptr, hasPairs ? &pairs : nullptr);
        if (m_check.expect("cullet_box_set_pairs()", status, faults))
            m_check.require(isSame(pairs, m_model.held()), "cullet_box_set_pairs()", "returns other pairs");
        else
            m_check.require(pairs.count == kUnset, "cullet_box_set_pairs()", "writes in a failed call");
    }

    void readStats(Choices& choices)
    {
        constexpr std::uint32_t kSize = sizeof(cullet_box_set_stats);
        const std::uint32_t sizes[] = {kSize, kSize + 16, 0, kSize - 1, 4};
        Faults faults;
        const bool hasSet = !faults.add(m_set == nullptr || choices.chance(4), CULLET_ERROR_NULL);
        const bool hasStats = !faults.add(choices.chance(8), CULLET_ERROR_NULL);
        Sized<cullet_box_set_stats> stats(sizes[choices.below(5)], 0xcd);
        faults.add(hasStats && stats.known.size < kSize, CULLET_ERROR_SIZE);
        const Sized<cullet_box_set_stats> before = stats;
        const cullet_status status =
            cullet_box_set_get_stats(hasSet ? m_set : nullptr, hasStats ? &stats.known : nullptr);
        if (!m_check.expect("cullet_box_set_get_stats()", status, faults))
        {
            m_check.require(stats == before, "cullet_box_set_get_stats()", "writes in a failed call");
            return;
        }
        const std::string name = stats.known.backend;
        m_check.require(stats.known.boxes == m_model.live().size() &&
                            stats.known.pairs == m_model.held().size() && stats.known.fallbacks == 0 &&
                            (name == "grid" || name == "brute"),
                        "cullet_box_set_get_stats()", "has other numbers");
        m_check.require(std::memcmp(stats.later, before.later, sizeof stats.later) == 0 &&
                            stats.known.size == before.known.size,
                        "cullet_box_set_get_stats()", "writes members that it does not know");
    }

private:
    static constexpr std::uint32_t kUnset = 0xfffffff0u;
    static constexpr std::size_t kMostBoxes = 600;

    /// Boxes at a distance that may be wrong, or leave floats unaligned.
    class Strided
    {
    public:
        Strided(const std::vector<Aabb>& boxes, Choices& choices)
        {
            const std::size_t strides[] = {0, 24, 28, 25, 40, 23, 1};
            m_stride = strides[choices.chance(64) ? choices.below(7) : 0];
            const std::size_t step = m_stride < sizeof(Aabb) ? sizeof(Aabb) : m_stride;
            m_bytes.resize(step * boxes.size() + 1, 0xee);
            for (std::size_t i = 0; i < boxes.size(); ++i)
                std::memcpy(m_bytes.data() + i * step, &boxes[i], sizeof(Aabb));
        }
        bool isWrong() const { return m_stride != 0 && m_stride < sizeof(Aabb); }
        const float* data() const { return reinterpret_cast<const float*>(m_bytes.data()); }
        std::size_t stride() const { return m_stride; }

    private:
        std::vector<unsigned char> m_bytes;
        std::size_t m_stride;
    };

    static float anyMargin(Choices& choices)
    {
        const float margins[] = {0, 0.125f, 0.5f, 3, -0.0f, -1, std::numeric_limits<float>::quiet_NaN()};
        return margins[choices.below(choices.chance(32) ? 7 : 4)];
    }

    static bool areAllSolid(const std::vector<Aabb>& boxes)
    {
        return std::all_of(boxes.begin(), boxes.end(),
                           [](const Aabb& box)
                           {
                               bool isSolid = true;
                               for (int axis = 0; axis < 3; ++axis)
                                   isSolid = isSolid && box.max[axis] >= box.min[axis];
                               return isSolid;
                           });
    }

    /// The first may be anything; the others are on a grid, so that many touch.
    std::vector<Aabb> anyBoxes(Choices& choices, std::uint32_t count)
    {
        std::vector<Aabb> boxes;
        Random random(choices.below(65536));
        const auto span = static_cast<float>(1 + random.below(12));
        for (std::uint32_t i = 0; i < count; ++i)
        {
            Aabb box;
            for (int axis = 0; axis < 3; ++axis)
            {
                box.min[axis] = std::floor(random.between(0, span) * 4) / 4;
                box.max[axis] = box.min[axis] + static_cast<float>(random.below(8)) / 4;
            }
            boxes.push_back(box);
        }
        if (!boxes.empty() && choices.chance(64))
        {
            float* const place = choices.chance(128) ? boxes[0].min : boxes[0].max;
            place[choices.below(3)] = choices.coordinate(true);
        }
        return boxes;
    }

    /// The boxes as they are, but for one coordinate, which is taken from given boxes.
    void stretch(const std::vector<std::uint32_t>& ids, std::uint32_t coordinate, std::vector<Aabb>& boxes)
    {
        for (std::size_t i = 0; i < ids.size(); ++i)
        {
            Aabb box = m_model.at(ids[i] - 1).box;
            float* const bounds = coordinate < 3 ? box.min : box.max;
            bounds[coordinate % 3] = (coordinate < 3 ? boxes[i].min : boxes[i].max)[coordinate % 3];
            boxes[i] = box;
        }
    }

    /// Ids of the set, and sometimes one that it does not have.
    std::vector<std::uint32_t> anyIds(Choices& choices, Faults& faults)
    {
        std::vector<std::uint32_t> ids;
        const auto& live = m_model.live();
        const bool isRun = choices.chance(16);
        const std::uint32_t count = isRun ? static_cast<std::uint32_t>(live.size()) : choices.below(4);
        for (std::uint32_t i = 0; i < count && !live.empty(); ++i)
            ids.push_back(1 + live[isRun ? i : choices.byte() % live.size()]);
        if (choices.chance(12))
        {
            const std::uint32_t strange[] = {0, m_nextId, 0xffffffffu, 1};
            const std::uint32_t id = strange[choices.below(4)];
            const bool isLive = std::find(live.begin(), live.end(), id - 1) != live.end();
            faults.add(!isLive, CULLET_ERROR_ID);
            ids.push_back(id);
        }
        return ids;
    }

    static bool isSame(const cullet_pairs& pairs, const Pairs& expected)
    {
        return pairs.count == expected.size() &&
               (pairs.count == 0 ||
                std::memcmp(pairs.data, expected.data(), expected.size() * sizeof(cullet_pair)) == 0);
    }

    CallCheck& m_check;
    cullet_box_set* m_set = nullptr;
    BoxModel m_model;  ///< the row of an id is one less
    std::uint32_t m_nextId = 1;
    float m_margin = 0;
};
}  // namespace cullet::test
