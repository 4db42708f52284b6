// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/contact_stats.h"
#include "cullet/plugin/convex/manifold_record.h"
#include "cullet/plugin/convex/pair_kind.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
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
/// A job changes nothing but its own algorithm and manifolds, so every order gives the same contacts. All manifolds of most
/// jobs exist before. Those of a compound come and go while it is processed: such jobs record that, and so does the calling
/// thread from the first of them on. All of it is repeated at the end, in the order of pairs.
class ContactJobs
{
public:
    /// @param loops, dispatcher must outlive this object
    ContactJobs(ParallelLoops& loops, btCollisionDispatcher& dispatcher)
        : m_loops(loops), m_dispatcher(dispatcher)
    {
    }

    /// @param kind see isJob()
    /// @return false if out of memory
    bool tryAdd(const ContactJob& job, PairKind kind) noexcept;
    /// Runs all jobs and forgets them. They are run on the calling thread if they are few, or if no thread or memory
    /// is available. Errors: that of the first pair whose job throws, after all other jobs; see repeatRecords().
    void run(const btDispatcherInfo& info);

    /// Repeats what the last jobs recorded, if run() found no memory for that.
    /// Errors: what an allocator of the application throws; a later call goes on.
    void repeatRecords();
    /// False: the array of manifolds is that of Bullet.
    bool hasRecords() const { return !m_recorded.empty() || !m_ofPass.isEmpty(); }
    /// What follows on all that is recorded.
    ManifoldRecord& lastRecord() { return m_ofPass; }

    /// Whether so many pairs would run on the calling thread, if they are like those of the last jobs. Call once per
    /// dispatch: the last jobs are forgotten from time to time, since pairs may have become others.
    bool areTooFew(std::uint64_t pairs);

    ContactStats& stats() { return m_stats; }

private:
    static constexpr std::uint32_t kNotRecorded = ~std::uint32_t(0);

    struct Entry
    {
        ContactJob job;
        std::uint32_t recorded;  ///< index in m_recorded, or kNotRecorded
    };
    /// The manifolds of a compound's pair.
    struct Recorded
    {
        ManifoldRecord before;  ///< of the pass, since the last such pair
        ManifoldRecord own;
    };
    /// The error of the first pair that fails.
    class Failure
    {
    public:
        /// Call it in a handler, on any thread.
        void keep(std::size_t place) noexcept;
        void rethrow();

    private:
        std::mutex m_mutex;
        std::size_t m_place = 0;
        std::exception_ptr m_error;
    };
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

    void add(const ContactJob& job, PairKind kind);
    void run(const Entry& entry, const btDispatcherInfo& info);
    void run(const btDispatcherInfo& info, std::size_t begin, std::size_t end) noexcept;
    void runAll(const btDispatcherInfo& info);
    void runOnAllThreads(const btDispatcherInfo& info);
    unsigned taskCount() const;

    ParallelLoops& m_loops;
    btCollisionDispatcher& m_dispatcher;
    std::vector<Entry> m_jobs;
    std::vector<Recorded> m_recorded;
    ManifoldRecord m_ofPass;                   ///< since the last of m_recorded
    std::optional<Recording> m_passRecording;  ///< while there are jobs that record
    Failure m_failure;
    double m_work = 0;  ///< of all jobs, in nanoseconds
    double m_workOfPair = 0;
    unsigned m_dispatches = 0;
    ContactStats m_stats;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
