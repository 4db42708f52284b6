// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/plugin/isa_gjk.h"

#include <memory>
#include <vector>

namespace cullet
{
class ParallelLoops;

inline namespace CULLET_PRECISION
{
class IsaGjkAlgorithm;

struct DispatcherOptions
{
    /// Most threads of the search for idle pairs, which has as many as its work is worth; 0: as many as the machine has.
    /// Contacts never depend on it.
    int threads = 0;
    IsaGjkOptions isaGjk;
};

/// Takes the place of btCollisionDispatcher, with ISA-GJK registered: finds the pairs that are still too far apart for
/// contacts on several threads, and lets Bullet's ordinary path handle the others one by one.
///
/// Only what is known to change nothing is left out: pairs whose algorithm is an IsaGjkAlgorithm without contacts, whose
/// shapes were too far apart in the last step, or are new, and are too far apart now. The threads read bodies and shapes
/// and write to these algorithms only, so that a Bullet library without thread support will do. Contacts, callbacks and
/// their order are the same for any number of threads.
///
/// A pair of ISA-GJK has no manifold before its shapes come close, unless a body is kinematic, or becomes so: Bullet makes one for
/// every pair of overlapping boxes, and its islands and solver walk over all of them. All other manifolds are there in the order in
/// which btCollisionDispatcher makes them: a world of pairs that Bullet has algorithms of its own for (boxes; spheres and capsules;
/// compounds and planes with these) has the same bits with both. A callback during the dispatch that moves a body has its effect
/// on idle pairs in the next step.
///
/// With a near callback of the application, or DISPATCH_CONTINUOUS, every pair takes Bullet's path.
/// Shapes of its pairs must not be edited during a dispatch, nor made anew in the memory of another that was one of these.
/// Callbacks may do both to other shapes, and ask about them by contactTest() and contactPairTest().
class CULLET_API Dispatcher : public btCollisionDispatcher
{
public:
    /// @param configuration must outlive this object
    explicit Dispatcher(btCollisionConfiguration* configuration, const DispatcherOptions& options = {});
    ~Dispatcher() override;

    void dispatchAllCollisionPairs(btOverlappingPairCache* pairCache, const btDispatcherInfo& info,
                                   btDispatcher* dispatcher) override;

    IsaGjkStats stats() const { return m_isaGjk.stats(); }
    /// Pairs that the last dispatch left out.
    std::uint64_t idlePairs() const { return m_idlePairs; }
    /// Of these, pairs known to be apart by how little their bodies have moved, without a look at their shapes; none in a
    /// dispatch in which hardly a body is awake. May differ from run to run with several threads: what a body's motion has
    /// spared is counted without locks, and bodies whose motion spares little are left alone for a while. Neither contacts nor
    /// idlePairs() depend on it.
    std::uint64_t stillPairs() const { return m_stillPairs; }

private:
    class Callback;

    bool makeAlgorithms(btBroadphasePair* pairs, std::size_t count, std::vector<std::uint32_t>& asked);
    IsaGjkAlgorithm* makeAlgorithm(btBroadphasePair& pair);
    btScalar breakingThresholdOf(const btCollisionObject& a, const btCollisionObject& b) const;
    bool makeAndWatch(btBroadphasePair* pairs, std::size_t count);
    bool learn(btBroadphasePair* pairs, std::size_t count);
    void learn(btBroadphasePair& pair, std::size_t place);
    void watchAnew(btBroadphasePair* pairs, std::size_t count);
    void findIdlePairs(btBroadphasePair* pairs, std::size_t count, bool isWatched);
    void updateMotions();
    void findIdle(const btBroadphasePair* pairs, std::size_t count, const std::vector<std::uint32_t>& asked);
    struct Found
    {
        std::uint64_t idle = 0, still = 0;
    };
    Found findIdle(const btBroadphasePair* pairs, const std::uint32_t* asked, const std::uint32_t* end);
    template <class Body>
    void forAll(std::size_t count, const Body& body);

    IsaGjkRegistration& m_isaGjk;
    std::unique_ptr<ParallelLoops> m_workers;
    btNearCallback m_ownNearCallback;
    /// By place in the pair array: the algorithm if the pair is idle, else null. The pointer tells that the place still
    /// belongs to the pair, since callbacks may remove bodies during the dispatch.
    Array<const btCollisionAlgorithm*> m_idle;
    std::uint64_t m_idlePairs = 0, m_stillPairs = 0, m_testedPairs = 0;
    bool m_isUpdateMissing = false;  ///< of some pair, with the motions of its bodies
    bool m_asksInTurn = false;       ///< whether pairs are idle is found when Bullet comes to them
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
