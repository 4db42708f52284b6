// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A table of boxes drives up to three backends at once; each update of each is compared with brute force.

#include "cullet/tests/fuzz/backend_choice.h"
#include "cullet/tests/fuzz/box_choice.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/pair_difference.h"
#include "cullet/tests/fuzz/table_twin.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
const char* const kFuzzTargetName = "backends";

namespace
{
constexpr std::size_t kMostProxies = 320;
constexpr std::uint32_t kMostIds = 4000;
constexpr std::uint32_t kMostUpdates = 300;

enum class Operation
{
    Update,
    Create,
    Destroy,
    Shift,
    Teleport,
    Resize,
    MakeStrange,
    Copy,
    Refilter,
    SetMargin,
    Restart,
    ChangeBackend,
    CreateMany,
    DestroyMany,
    SetMany,
    Run,
    Clear,
    CollectForQueries,
    kCount
};

class BackendRun
{
public:
    BackendRun(const std::uint8_t* data, std::size_t size) : m_choices(data, size)
    {
        const std::uint32_t count = 1 + m_choices.below(3);
        m_idKind = m_choices.below(4);
        m_margin = m_choices.chance(128) ? 0.0625f : 0.0f;
        for (std::uint32_t i = 0; i < count; ++i)
            m_backends.push_back(chosenBackend(m_choices));
    }

    std::string run()
    {
        for (m_choices.nextOperation(); !m_choices.isEmpty() && m_fault.empty(); m_choices.nextOperation())
        {
            operate(static_cast<Operation>(m_choices.below(static_cast<std::uint32_t>(Operation::kCount))));
            if (m_choices.chance(128))
                update();
        }
        update();
        update();
        return m_fault;
    }

private:
    void operate(Operation operation)
    {
        const bool needsProxy = operation >= Operation::Destroy && operation <= Operation::Refilter;
        if (needsProxy && m_model.live().empty())
            return;
        switch (operation)
        {
            case Operation::Create:
                return createOne();
            case Operation::Destroy:
                return m_twin.destroy(anyIndex());
            case Operation::Shift:
                return shift(anyRow());
            case Operation::Teleport:
            case Operation::Resize:
                return replace(operation == Operation::Resize);
            case Operation::MakeStrange:
                return makeStrange();
            case Operation::Copy:
                return copy();
            case Operation::Refilter:
                return refilter(anyRow());
            case Operation::SetMargin:
                return setMargin();
            case Operation::Restart:
                return restart();
            case Operation::ChangeBackend:
                return changeBackend();
            case Operation::CreateMany:
                return createMany();
            case Operation::DestroyMany:
                return destroyMany();
            case Operation::SetMany:
                return setMany();
            case Operation::Run:
                return moveForSteps();
            case Operation::Clear:
                return clear();
            case Operation::CollectForQueries:
                return fail(m_twin.collectForQueries());
            default:
                return update();
        }
    }

    // What is chosen.

    std::size_t anyIndex() { return m_choices.below(static_cast<std::uint32_t>(m_model.live().size())); }
    ProxyId anyRow() { return m_model.live()[anyIndex()]; }

    /// Ids that ascend from 1, that ascend to the end of the range, that descend, or in no order.
    std::uint32_t nextId()
    {
        const std::uint32_t number = ++m_idCount;
        const std::uint32_t ids[] = {number, 0xffffffffu - kMostIds + number, 1000000u - number,
                                     number * 2654435761u};
        return ids[m_idKind];
    }

    // What is done.

    void create(const Aabb& box, Filter filter)
    {
        if (m_model.live().size() >= kMostProxies || m_idCount >= kMostIds)
            return;
        const std::uint32_t id = nextId();
        m_twin.create(box, id, filter);
        m_ids.push_back(id);
    }

    void createOne()
    {
        const Aabb box = chosenBox(m_choices);
        create(box, chosenFilter(m_choices));
    }

    void shift(ProxyId row)
    {
        const int scale = static_cast<int>(m_choices.below(24));
        Aabb box = m_model.at(row).box;
        for (int axis = 0; axis < 3; ++axis)
        {
            const float way = std::ldexp(static_cast<float>(m_choices.byte()) - 128.0f, -scale);
            box.min[axis] += way;
            box.max[axis] += way;
        }
        m_twin.setBox(row, box);
    }

    void replace(bool keepsPlace)
    {
        const ProxyId row = anyRow();
        Aabb box = m_model.at(row).box;
        if (keepsPlace)
            resize(m_choices, box);
        else
            box = chosenBox(m_choices);
        m_twin.setBox(row, box);
    }

    void makeStrange()
    {
        const ProxyId row = anyRow();
        m_twin.setBox(row, chosenStrangeBox(m_choices));
    }

    void copy()
    {
        const ProxyId from = anyRow();
        m_twin.setBox(anyRow(), m_model.at(from).box);
    }

    void refilter(ProxyId row) { m_twin.setFilter(row, chosenFilter(m_choices)); }

    void setMargin()
    {
        const float small = m_choices.of({0.0f, 0.0625f, 0.25f, 2.0f});
        m_margin = m_choices.chance(96) ? std::fabs(m_choices.coordinate(true)) : small;
        if (std::isnan(m_margin))
            m_margin = 0.05f;
    }

    void restart()
    {
        Pairs known = m_model.held();
        const std::uint32_t kind = m_choices.below(5);
        const std::uint32_t stride = 1 + m_choices.below(7);
        if (kind == 1)
            known.clear();
        else if (kind == 2)
            known = everyOther(known, stride);
        else if (kind == 3)
            addStale(known);
        else if (kind == 4)
            m_useFilter = !m_useFilter;
        m_twin.hold(known);
        for (const auto& backend : m_backends)
            backend->restart(known);
    }

    static Pairs everyOther(const Pairs& pairs, std::uint32_t stride)
    {
        Pairs some;
        for (std::size_t i = 0; i < pairs.size(); ++i)
            if (i % (stride + 1) != 0)
                some.push_back(pairs[i]);
        return some;
    }

    /// Adds pairs of proxies that live or lived.
    void addStale(Pairs& known)
    {
        for (int i = 0; i < 5 && !m_ids.empty(); ++i)
        {
            const auto count = static_cast<std::uint32_t>(m_ids.size());
            const std::uint32_t a = m_ids[m_choices.below(count)];
            const std::uint32_t b = m_ids[m_choices.below(count)];
            if (a != b)
                known.push_back(makePair(a, b));
        }
        std::sort(known.begin(), known.end());
        known.erase(std::unique(known.begin(), known.end()), known.end());
    }

    void changeBackend()
    {
        auto& backend = m_backends[m_choices.below(static_cast<std::uint32_t>(m_backends.size()))];
        backend = chosenBackend(m_choices);
        backend->restart(m_model.held());
    }

    /// A row, a square or a cube of boxes of one size.
    void createMany()
    {
        const std::uint32_t count = 1 + m_choices.below(100);
        const std::uint32_t side = m_choices.of({100u, 10u, 5u, 1u});
        const float spacing = static_cast<float>(m_choices.byte()) / 32;
        const Aabb first = chosenBox(m_choices);
        m_noise = Noise(m_choices.byte());
        const float reach = m_choices.of({0.0f, 0.25f, 4.0f, 0.001f});
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const std::uint32_t place[] = {i % side, i / side % side, i / side / side};
            Aabb box = first;
            for (int axis = 0; axis < 3; ++axis)
                moveAlong(box, axis, spacing * static_cast<float>(place[axis]));
            m_noise.move(box, reach);
            create(box, {1, -1});
        }
    }

    void destroyMany()
    {
        const std::size_t stride = 1 + m_choices.below(8);
        for (std::size_t index = m_choices.below(8); index < m_model.live().size(); index += stride - 1)
            m_twin.destroy(index);
    }

    /// Through setBoxes(): some boxes are as they were.
    void setMany()
    {
        const std::size_t stride = 1 + m_choices.below(8);
        m_noise = Noise(m_choices.byte());
        const float reach = m_choices.of({0.0f, 0.01f, 1.0f, 20.0f});
        std::vector<Aabb> boxes(m_model.size());
        std::vector<ProxyId> rows;
        for (std::size_t i = m_choices.below(8); i < m_model.live().size(); i += stride)
        {
            const ProxyId row = m_model.live()[i];
            Aabb& box = boxes[row];
            box = m_model.at(row).box;
            if (m_noise.upTo(1) > 0)
            {
                m_noise.move(box, reach);
            }
            rows.push_back(row);
        }
        m_twin.setBoxes(boxes, rows);
    }

    /// Updates in which some proxies move and the others rest.
    void moveForSteps()
    {
        const std::uint32_t steps = 1 + m_choices.below(48);
        const std::size_t first = m_choices.byte();
        const std::size_t stride = 1 + m_choices.below(64);
        const float reach = std::ldexp(1.0f, 2 - static_cast<int>(m_choices.below(16)));
        const float drift = m_choices.chance(64) ? reach : 0.0f;
        m_noise = Noise(m_choices.byte());
        for (std::uint32_t step = 0; step < steps && m_fault.empty(); ++step)
        {
            for (std::size_t i = first; i < m_model.live().size(); i += stride)
            {
                const ProxyId row = m_model.live()[i];
                Aabb box = m_model.at(row).box;
                m_noise.move(box, reach);
                moveAlong(box, 0, drift);
                m_twin.setBox(row, box);
            }
            update();
        }
    }

    void clear()
    {
        while (!m_model.live().empty())
            m_twin.destroy(m_model.live().size() - 1);
        if (m_choices.chance(128))
            update();
        m_twin.clear();
        for (const auto& backend : m_backends)
            backend->restart(m_model.held());
        if (!m_model.held().empty())
            return;
        // No pair is known by the ids of before, so they may come again.
        m_idCount = 0;
        m_ids.clear();
    }

    // What is checked.

    void update()
    {
        if (!m_fault.empty() || m_updates++ >= kMostUpdates)
            return;
        const ProxyView view = m_twin.table().beginUpdate(m_margin, m_useFilter);
        fail(m_twin.faultOf(view));
        const PairDelta expected = m_twin.updateModel(m_margin, m_useFilter);
        for (const auto& backend : m_backends)
            check(*backend, view, expected);
        m_twin.table().endUpdate();
    }

    void check(Backend& backend, const ProxyView& view, const PairDelta& expected)
    {
        if (!m_fault.empty())
            return;
        // Remains of an earlier update have no effect.
        m_delta.added.assign(3, {7, 9});
        m_delta.removed.assign(2, {7, 9});
        const Status status = backend.update(view, m_delta);
        const std::string where =
            std::string(backend.name()) + ", update " + std::to_string(m_updates) + ": ";
        if (status != Status::Ok)
            fail(where + "status " + std::to_string(static_cast<int>(status)));
        fail(differenceOf(where + "added", m_delta.added, expected.added));
        fail(differenceOf(where + "removed", m_delta.removed, expected.removed));
        const std::uint64_t held = backend.stats().pairs;
        if (held != m_model.held().size())
            fail(where + "counts " + std::to_string(held) + " pairs of " +
                 std::to_string(m_model.held().size()));
    }

    void fail(const std::string& fault)
    {
        if (m_fault.empty())
            m_fault = fault;
    }

    Choices m_choices;
    TableTwin m_twin;
    const BoxModel& m_model = m_twin.model();
    std::vector<std::unique_ptr<Backend>> m_backends;
    std::vector<std::uint32_t> m_ids;  ///< given so far, of proxies that live or lived
    PairDelta m_delta;
    std::string m_fault;
    float m_margin = 0;
    bool m_useFilter = true;
    std::uint32_t m_idKind = 0;
    std::uint32_t m_idCount = 0;
    std::uint32_t m_updates = 0;
    Noise m_noise{1};
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    return BackendRun(data, size).run();
}
}  // namespace cullet::test
