// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"

#include <atomic>
#include <cstdint>
#include <memory>

namespace cullet
{
/// Short loops one after the other, each divided into the same parts: a part of a loop runs when all parts of the loop
/// before are done.
///
/// A thread keeps its part through all loops, so that what the part touches stays in that thread's cache, and waits for the
/// others by reading what each has written. As in a ForkJoin, no loop waits for a thread that has not joined, or that was
/// descheduled between two loops: another one runs its part.
class StagedLoop
{
public:
    /// Calls body(stage, part, thread) for each stage in [0, stages) and each part in [0, parts). Of two stages all parts of
    /// the first one come before.
    ///
    /// @param body throws nothing
    template <class Body>
    void run(ParallelLoops& loops, unsigned parts, unsigned stages, const Body& body)
    {
        if (parts <= 1 || stages == 0)
        {
            for (unsigned stage = 0; stage < stages; ++stage)
                body(stage, 0u, 0u);
            return;
        }
        reset(parts, stages);
        loops.run(parts,
                  [&](unsigned own, unsigned thread)
                  {
                      Turn turn{own, 0};
                      for (unsigned spins = 0; next(own, spins, turn);)
                      {
                          body(turn.stage, turn.part, thread);
                          finish(turn);
                          spins = 0;
                      }
                  });
    }

private:
    /// Twice the number of stages that are done, plus one while a thread runs the next.
    struct alignas(64) Part
    {
        std::atomic<std::uint32_t> progress;
    };
    struct Turn
    {
        unsigned part;
        std::uint32_t stage;
    };

    void reset(unsigned parts, unsigned stages);
    bool next(unsigned own, unsigned& spins, Turn& turn);
    unsigned partBehind(std::uint32_t stage) const;
    bool take(unsigned part, Turn& turn);
    void finish(const Turn& turn)
    {
        m_parts[turn.part].progress.store(2 * turn.stage + 2, std::memory_order_release);
    }

    std::unique_ptr<Part[]> m_parts;
    unsigned m_capacity = 0;
    unsigned m_count = 0;
    std::uint32_t m_end = 0;  ///< progress of a part with all stages
};
}  // namespace cullet
