// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/plugin/convex/contact_stats.h"
#include "cullet/plugin/isa_gjk.h"

#include <memory>
#include <vector>

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
class ContactJobs;
class PairCache;
class IsaGjkAlgorithm;

struct DispatcherOptions
{
    /// Upper limit for the threads that search for idle pairs and compute contacts; fewer are used for little work. 0:
    /// as many as the machine has. Contacts never depend on it.
    int threads = 0;
    /// Contact callbacks (gContactAddedCallback and the others), gCalculateCombined...Callbacks and callbacks for children
    /// of compounds (gCompoundChildShapePairCallback and the other) of the application may be called on several threads at
    /// once, in any order, and throw nothing. If false, contacts are computed on the calling thread while one is set, in
    /// the order of Bullet; a callback for children concerns compounds only. Functions of shapes are not meant: those of
    /// classes derived from Bullet's, which may keep state in the shape, run on the calling thread in any case.
    bool callbacksAreThreadSafe = false;
    IsaGjkOptions isaGjk;
};

/// Replaces btCollisionDispatcher, with ISA-GJK registered: finds the pairs that are still too far apart for contacts,
/// and computes the contacts of the others, both on several threads.
///
/// A pair is left out only if its dispatch would change nothing: its algorithm is an IsaGjkAlgorithm without contacts,
/// its shapes were too far apart in the last step, or the pair is new, and they are too far apart now. So is a pair with a
/// compound, of Bullet's shapes without triangles, that had no contacts in the last step and has not changed since: neither
/// poses nor shapes nor children.
///
/// The others take part in one pass in the order of Bullet, which creates algorithms and manifolds. Contacts of ISA-GJK, of
/// boxes, spheres, capsules and planes, of all these on Bullet's meshes and height fields, and of compounds of all these,
/// are computed after the pass, if all shapes are exactly of Bullet's classes. Shapes of derived classes, compounds with
/// one among their parts, and other algorithms of Bullet are handled in the pass. An algorithm of the application is
/// handled there too, after the contacts of all earlier pairs. The threads read bodies and shapes and write to the
/// algorithm and manifolds of one pair each, so a Bullet library without thread support suffices. Algorithms and manifolds
/// of the parts of a compound come from btAlignedAlloc() on all threads, not from Bullet's pools; the manifolds enter and
/// leave the dispatcher's array at the end, in the order of Bullet. If a job throws, the others are run; the error is that
/// of the first such pair. Errors: what an allocator of the application throws. Contacts, manifolds and their order, and
/// callbacks and theirs, are the same for any number of threads. contactStats() says what happened, and SerialReason when
/// all contacts are computed in the pass.
///
/// A pair of ISA-GJK gets no manifold before its shapes are close, unless a body is or becomes kinematic; Bullet
/// creates one for every pair of overlapping boxes, and its islands and solver visit all of them. All other manifolds
/// are created in the order of btCollisionDispatcher: a world of spheres and capsules, and of boxes with
/// BoxPairs::Bullet, compounds and planes with these too, gives the same bits with both dispatchers. If a callback
/// moves a body during the dispatch, idle pairs react in the next step.
///
/// With a near callback of the application, or DISPATCH_CONTINUOUS, every pair takes Bullet's path.
/// During a dispatch, shapes of its pairs must not be edited, nor may a new shape be created at the address of one of
/// them. Callbacks may do both with other shapes, and may pass them to contactTest() and contactPairTest(). A profiler
/// of the application (btSetCustomEnterProfileZoneFunc) is entered on all threads, for triangles of meshes and parts of
/// compounds.
class CULLET_API Dispatcher : public btCollisionDispatcher
{
public:
    /// @param configuration must outlive this object
    explicit Dispatcher(btCollisionConfiguration* configuration, const DispatcherOptions& options = {});
    ~Dispatcher() override;

    void dispatchAllCollisionPairs(btOverlappingPairCache* pairCache, const btDispatcherInfo& info,
                                   btDispatcher* dispatcher) override;

    /// As Bullet's, except while the contacts of compounds are computed on several threads: a manifold then enters or
    /// leaves the array at the end, in the order of Bullet.
    btPersistentManifold* getNewManifold(const btCollisionObject* a, const btCollisionObject* b) override;
    void releaseManifold(btPersistentManifold* manifold) override;

    /// Memory for the algorithm of a pair or of a part of a shape: of Bullet's pool, or of a thread that computes
    /// contacts.
    void* allocateCollisionAlgorithm(int size) override;
    void freeCollisionAlgorithm(void* algorithm) override;

    IsaGjkStats stats() const { return m_isaGjk.stats(); }
    /// Where contacts were computed, and why not on several threads.
    const ContactStats& contactStats() const;
    /// Number of pairs that the last dispatch left out, of those with an awake body.
    std::uint64_t idlePairs() const { return m_idlePairs; }
    /// Lets dispatches find out whether a pair is foreign, which takes some ten nanoseconds per pair with an awake body.
    /// Off by default: all of these are foreign then.
    void setFindsForeignPairs(bool finds) { m_findsForeignPairs = finds; }
    /// Says that no body of a cache's pairs is active, so that Bullet would process none of them: a dispatch leaves them all out
    /// if no pair has come or gone by then. Until it is taken back by null.
    void expectSleep(const PairCache* cache);
    /// Whether a pair of the last dispatch may have called the application: a callback, a body, a shape or an algorithm of a
    /// class of its own. Sleeping pairs do not, nor do those of Bullet's classes that several threads may compute
    /// (contactStats()).
    bool hadForeignPairs() const { return m_hadForeignPairs; }
    /// The part of idlePairs() that the motion bounds of the bodies proved separated, without access to their shapes.
    /// 0 in a dispatch in which hardly any body is awake. May differ between runs with several threads: the use of a
    /// body's motion is counted without locks, and bodies whose motion is of little use are paused for some updates.
    /// Neither contacts nor idlePairs() depend on it.
    std::uint64_t stillPairs() const { return m_stillPairs; }

private:
    class NearPass;

    bool isAsleep(const btOverlappingPairCache& cache, const btDispatcherInfo& info) const;
    bool mayLeaveOutSleepers(const btDispatcherInfo& info) const;
    bool areFewAndAsleep(const btOverlappingPairCache& cache, const btDispatcherInfo& info) const;
    void skipDispatch();
    bool makeAlgorithms(btBroadphasePair* pairs, std::size_t count, std::vector<std::uint32_t>& isaGjkPairs);
    IsaGjkAlgorithm* makeAlgorithm(btBroadphasePair& pair);
    btScalar breakingThresholdOf(const btCollisionObject& a, const btCollisionObject& b) const;
    bool makeAndTrack(btBroadphasePair* pairs, std::size_t count);
    bool classify(btBroadphasePair* pairs, std::size_t count);
    void classify(btBroadphasePair& pair, std::size_t place);
    void trackAgain(btBroadphasePair* pairs, std::size_t count);
    void findIdlePairs(btBroadphasePair* pairs, std::size_t count, bool isTracked);
    void updateMotions();
    void findIdle(const btBroadphasePair* pairs, std::size_t count,
                  const std::vector<std::uint32_t>& isaGjkPairs);
    struct IdleCounts
    {
        std::uint64_t idle = 0, still = 0, tested = 0;
    };
    IdleCounts findIdle(const btBroadphasePair* pairs, const std::uint32_t* isaGjkPairs,
                        const std::uint32_t* end);
    template <class Body>
    void parallelFor(std::size_t count, const Body& body);

    IsaGjkRegistration& m_isaGjk;
    std::unique_ptr<ParallelLoops> m_workers;
    std::unique_ptr<ContactJobs> m_jobs;
    bool m_callbacksAreThreadSafe;
    btNearCallback m_ownNearCallback;
    /// By index in the pair array: the algorithm if the pair is idle, else null. The pointer shows whether the entry
    /// still belongs to the pair, since callbacks may remove bodies during the dispatch.
    Array<const btCollisionAlgorithm*> m_idle;
    std::uint64_t m_idlePairs = 0, m_stillPairs = 0, m_testedPairs = 0;
    const PairCache* m_sleepingCache = nullptr;  ///< expectSleep()
    std::uint64_t m_sleepingVersion = 0;
    bool m_findsForeignPairs = false;
    bool m_hadForeignPairs = false;
    /// Some pair, or the motions of its bodies, missed an update.
    bool m_hasMissedUpdate = false;
    bool m_testsInTurn = false;  ///< each pair is tested when Bullet processes it, not in advance
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
