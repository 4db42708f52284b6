// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/solvers.h"

#include "cullet/plugin/solver.h"
#include "cullet/preload/kept_beside.h"
#include "cullet/preload/message.h"
#include "cullet/preload/settings.h"

#include <algorithm>
#include <cinttypes>
#include <exception>
#include <memory>
#include <mutex>
#include <new>

namespace cullet::preload
{
namespace
{
void keepLargest(const SolverStats& of, SolverStats& most)
{
    most.groups = std::max(most.groups, of.groups);
    most.refusedGroups = std::max(most.refusedGroups, of.refusedGroups);
    most.contacts = std::max(most.contacts, of.contacts);
    most.joints = std::max(most.joints, of.joints);
}

/// All stand-ins of solvers.
struct Solvers
{
    KeptBeside<SolverWithoutState::Parts> parts;
    std::mutex mutex;  ///< of the counts
    SolverStats most;  ///< of those that ended, in what they solved last
};

/// Never destroyed: the program may destroy its solvers after this library's statics.
Solvers& solvers()
{
    static auto& result = *new Solvers;
    return result;
}

/// A cullet::Solver in memory that the program has allocated for Bullet's type. Its state is found by its address.
class SolverStandIn final : public SolverWithoutState
{
public:
    /// Adds the state; throws std::bad_alloc.
    static void prepare(void* memory, const SolverOptions& options)
    {
        auto& solver = *static_cast<btSequentialImpulseConstraintSolver*>(memory);
        solvers().parts.add(memory, makeParts(solver, options));
    }

    ~SolverStandIn() override
    {
        Solvers& all = solvers();
        {
            const std::lock_guard<std::mutex> lock(all.mutex);
            keepLargest(stats(), all.most);
        }
        all.parts.remove(this);
    }

    bool takesTasks() const override { return true; }

private:
    Parts& parts() const override { return solvers().parts.of(this); }
};

using Stock = btSequentialImpulseConstraintSolver;
static_assert(sizeof(SolverStandIn) == sizeof(Stock), "the program has taken no more memory");
static_assert(alignof(SolverStandIn) == alignof(Stock), "the program has aligned its memory for Bullet");
}  // namespace

bool constructSolver(void* memory)
{
    if (!settings().solver.has_value())
        return false;
    SolverOptions options;
    options.model = *settings().solver;
    try
    {
        SolverStandIn::prepare(memory, options);
    }
    catch (const std::exception& problem)
    {
        printLine("no solver (%s); Bullet's own is used", problem.what());
        return false;
    }
    ::new (memory) SolverStandIn;
    return true;
}

bool destroySolver(void* memory, DynamicsFunction how)
{
    if (!settings().solver.has_value() || !solvers().parts.has(memory))
        return false;
    destroyAs<SolverStandIn>(memory, how == DynamicsFunction::Delete);
    return true;
}

void writeSolvers()
{
    if (!settings().solver.has_value())
        return;
    Solvers& all = solvers();
    const std::lock_guard<std::mutex> lock(all.mutex);
    SolverStats most = all.most;
    all.parts.forEach([&](const void*, const SolverWithoutState::Parts& parts)
                      { keepLargest(SolverWithoutState::statsOf(parts), most); });
    printLine("solvers: %" PRIu64 "; at most %" PRIu32 " groups, %" PRIu32 " contacts and %" PRIu32
              " joints solved last, and %" PRIu32 " groups left to Bullet",
              all.parts.total(), most.groups, most.contacts, most.joints, most.refusedGroups);
}
}  // namespace cullet::preload
