// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Calls of the C interface with right and wrong arguments, against what cullet.h documents.

#include "cullet/tests/fuzz/c_interface/box_set_calls.h"
#include "cullet/tests/fuzz/c_interface/call_check.h"
#include "cullet/tests/fuzz/c_interface/hull_calls.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"

#include <cstring>
#include <limits>
#include <string>

namespace cullet::test
{
const char* const kFuzzTargetName = "c_interface";

namespace
{
/// Calls of one object each, and what they need.
class Session
{
public:
    std::string run(Choices& choices)
    {
        while (!choices.isEmpty() && m_check.fault().empty())
        {
            call(choices);
            choices.nextOperation();
        }
        return m_check.fault();
    }

private:
    void call(Choices& choices)
    {
        const std::uint32_t kind = choices.below(32);
        BoxSetCalls& boxes = m_boxes[choices.below(2)];
        if (kind < 2)
            boxes.create(choices);
        else if (kind < 7)
            boxes.add(choices);
        else if (kind < 13)
            boxes.move(choices);
        else if (kind < 15)
            boxes.filter(choices);
        else if (kind < 18)
            boxes.remove(choices);
        else if (kind < 22)
            boxes.update(choices);
        else if (kind == 22)
            boxes.readStats(choices);
        else if (kind < 25)
            m_hulls.create(choices);
        else if (kind == 25)
            m_hulls.changeCache(choices);
        else if (kind < 29)
            m_hulls.query(choices);
        else if (kind == 29)
            createBroadphase(choices);
        else if (kind == 30)
            callWithoutObjects(choices);
        else if (choices.below(4) == 0)
            readConstants(choices);
        else
            m_hulls.queryBatch(choices);
    }

    /// A broad phase needs a world of Bullet for more than this.
    void createBroadphase(Choices& choices)
    {
        constexpr std::uint32_t kSize = sizeof(cullet_broadphase_options);
        const auto right = static_cast<std::uint32_t>(cullet_precision() / 8);
        const std::uint32_t scalars[] = {right, 12 - right, 0, 16},
                            sizes[] = {kSize, kSize + 16, kSize - 1, 0};
        const std::uint32_t scalar = scalars[choices.chance(48) ? choices.below(4) : 0];
        Faults faults;
        faults.add(scalar == 12 - right, CULLET_ERROR_PRECISION);
        faults.add(scalar == 0 || scalar == 16, CULLET_ERROR_ARGUMENT);
        Sized<cullet_broadphase_options> options(sizes[choices.chance(48) ? choices.below(4) : 0]);
        const std::int32_t backends[] = {CULLET_BACKEND_GRID, CULLET_BACKEND_BRUTE, 4, -1};
        const std::int32_t threads[] = {1, 2, -1, 4097};
        const double margins[] = {0, 0.25, -1, std::numeric_limits<double>::quiet_NaN()};
        options.known.backend = backends[choices.below(choices.chance(32) ? 4 : 2)];
        options.known.threads = threads[choices.below(choices.chance(32) ? 4 : 2)];
        options.known.margin = margins[choices.below(choices.chance(32) ? 4 : 3)];
        const bool hasOptions = !choices.chance(48);
        if (hasOptions)
        {
            faults.add(options.known.size < kSize, CULLET_ERROR_SIZE);
            faults.add(options.known.backend < 0 || options.known.backend > 3, CULLET_ERROR_ARGUMENT);
            faults.add(options.known.threads < 0 || options.known.threads > 4096, CULLET_ERROR_ARGUMENT);
            faults.add(options.known.margin != options.known.margin, CULLET_ERROR_ARGUMENT);
        }
        const bool hasOut = !faults.add(choices.chance(16), CULLET_ERROR_NULL);
        cullet_broadphase* broadphase = nullptr;
        const cullet_status status = cullet_broadphase_create(scalar, hasOptions ? &options.known : nullptr,
                                                              hasOut ? &broadphase : nullptr);
        m_check.expect("cullet_broadphase_create()", status, faults);
        m_check.require((broadphase != nullptr) == !faults.any(), "cullet_broadphase_create()",
                        "sets a wrong handle");
        m_check.require((cullet_broadphase_interface(broadphase) != nullptr) == (broadphase != nullptr),
                        "cullet_broadphase_interface()", "is wrong");
        readBroadphase(choices, broadphase);
        cullet_broadphase_destroy(broadphase);
    }

    void readBroadphase(Choices& choices, cullet_broadphase* broadphase)
    {
        constexpr std::uint32_t kSize = sizeof(cullet_broadphase_stats);
        const std::uint32_t sizes[] = {kSize, kSize + 16, kSize - 1, 0};
        Sized<cullet_broadphase_stats> stats(sizes[choices.below(4)], 0xcd);
        const Sized<cullet_broadphase_stats> before = stats;
        Faults faults;
        faults.add(broadphase == nullptr, CULLET_ERROR_NULL);
        faults.add(stats.known.size < kSize, CULLET_ERROR_SIZE);
        const cullet_status status = cullet_broadphase_get_stats(broadphase, &stats.known);
        if (m_check.expect("cullet_broadphase_get_stats()", status, faults))
            m_check.require(
                stats.known.bodies == 0 && stats.known.pairs == 0 && stats.known.backend != nullptr,
                "cullet_broadphase_get_stats()", "has other numbers");
        else
            m_check.require(stats == before, "cullet_broadphase_get_stats()", "writes in a failed call");
    }

    /// Handles and results that are NULL.
    void callWithoutObjects(Choices& choices)
    {
        Faults faults;
        faults.add(true, CULLET_ERROR_NULL);
        cullet_pairs pairs = {};
        cullet_isa_gjk_stats stats = {};
        stats.size = sizeof stats;
        const auto scalar = static_cast<std::uint32_t>(cullet_precision() / 8);
        switch (choices.below(6))
        {
            case 0:
                m_check.expect("cullet_device_finder_create()", cullet_device_finder_create(nullptr, nullptr),
                               faults);
                break;
            case 1:
                m_check.expect("cullet_device_finder_enqueue()",
                               cullet_device_finder_enqueue(nullptr, nullptr, 0), faults);
                break;
            case 2:
                m_check.expect("cullet_device_finder_collect()",
                               cullet_device_finder_collect(nullptr, &pairs), faults);
                break;
            case 3:
                m_check.expect("cullet_isa_gjk_register()",
                               cullet_isa_gjk_register(scalar, nullptr, nullptr, nullptr), faults);
                break;
            case 4:
                m_check.expect("cullet_isa_gjk_get_stats()", cullet_isa_gjk_get_stats(nullptr, &stats),
                               faults);
                break;
            default:
                cullet_box_set_destroy(nullptr);
                cullet_hull_destroy(nullptr);
                cullet_hull_cache_destroy(nullptr);
                cullet_broadphase_destroy(nullptr);
                cullet_device_finder_destroy(nullptr);
        }
    }

    void readConstants(Choices& choices)
    {
        const std::int32_t status = static_cast<std::int32_t>(choices.byte()) - 128;
        const std::string name = cullet_status_name(status);
        const bool isKnown = status <= CULLET_SOME_NOT_CONVERGED && status >= CULLET_ERROR_INTERNAL;
        m_check.require(isKnown ? name.rfind("CULLET_", 0) == 0 : name == "unknown", "cullet_status_name()",
                        "is " + name);
        m_check.require(cullet_abi_version() == CULLET_ABI_VERSION, "cullet_abi_version()", "differs");
        m_check.require(cullet_precision() == 32 || cullet_precision() == 64, "cullet_precision()",
                        "is strange");
    }

    CallCheck m_check;
    BoxSetCalls m_boxes[2] = {BoxSetCalls(m_check), BoxSetCalls(m_check)};
    HullCalls m_hulls{m_check};
};
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    Choices choices(data, size);
    Session session;
    return session.run(choices);
}
}  // namespace cullet::test
