// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/contact_stats.h"
#include "cullet/plugin/convex/pair_kind.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
/// A pair of which Bullet's near callback has only processCollision() left to call.
struct ContactJob
{
    btCollisionAlgorithm* algorithm;
    const btCollisionObject *a, *b;

    /// The rest of Bullet's near callback.
    [[gnu::always_inline]] void run(const btDispatcherInfo& info) const
    {
        const btCollisionObjectWrapper wrapA(nullptr, a->getCollisionShape(), a, a->getWorldTransform(), -1,
                                             -1);
        const btCollisionObjectWrapper wrapB(nullptr, b->getCollisionShape(), b, b->getWorldTransform(), -1,
                                             -1);
        btManifoldResult result(&wrapA, &wrapB);
        algorithm->processCollision(&wrapA, &wrapB, info, &result);
    }
};

/// Computes the contacts of many pairs together, on all threads.
///
/// A job changes nothing but its own algorithm and manifold, and all manifolds exist before. So every order gives the
/// same contacts, and manifolds are created and released on the calling thread alone, in the order of pairs.
class ContactJobs
{
public:
    /// @param loops must outlive this object
    explicit ContactJobs(ParallelLoops& loops) : m_loops(loops) {}

    /// @param kind see isJob()
    /// @return false if out of memory
    bool tryAdd(const ContactJob& job, PairKind kind) noexcept;
    /// Runs all jobs and forgets them. They are run on the calling thread if they are few, or if no thread or memory
    /// is available. Errors: that of the first contact callback that throws; jobs that have not begun may be lost.
    void run(const btDispatcherInfo& info);

    /// Whether so many pairs would run on the calling thread, if they are like those of the last jobs. Call once per
    /// dispatch: the last jobs are forgotten from time to time, since pairs may have become others.
    bool areTooFew(std::uint64_t pairs);

    ContactStats& stats() { return m_stats; }

private:
    /// Forgets the jobs at the end of run(), however that ends.
    struct Clear
    {
        ~Clear()
        {
            jobs.m_jobs.clear();
            jobs.m_work = 0;
        }
        ContactJobs& jobs;
    };

    void run(const btDispatcherInfo& info, std::size_t begin, std::size_t end) const;
    void runOnAllThreads(const btDispatcherInfo& info);
    unsigned taskCount() const;

    ParallelLoops& m_loops;
    std::vector<ContactJob> m_jobs;
    double m_work = 0;  ///< of all jobs, in nanoseconds
    double m_workOfPair = 0;
    unsigned m_dispatches = 0;
    ContactStats m_stats;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
