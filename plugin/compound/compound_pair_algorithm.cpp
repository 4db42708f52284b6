// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/compound/compound_pair_algorithm.h"

#include "cullet/plugin/compound/tree_pairs.h"

#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btHashedSimplePairCache.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
const btCompoundShape& compoundOf(const btCollisionObjectWrapper& body)
{
    return static_cast<const btCompoundShape&>(*body.getCollisionShape());
}

btCollisionAlgorithm& algorithmOf(const btSimplePair& pair)
{
    return *static_cast<btCollisionAlgorithm*>(pair.m_userPointer);
}
}  // namespace

struct CompoundPairAlgorithm::Pairs
{
    /// Those with an algorithm. Bullet's cache, since manifolds are released in the order of its array.
    btHashedSimplePairCache cache;
    btAlignedObjectArray<ChildState> states;                   ///< of each pair in the array
    int revisionA = 0, revisionB = 0, countA = 0, countB = 0;  ///< of the compounds

    btSimplePairArray& array() { return cache.getOverlappingPairArray(); }

    /// The index of a pair; -1: none.
    ///
    /// @param likely where it probably is
    int find(int a, int b, int likely)
    {
        btSimplePairArray& pairs = array();
        if (likely < pairs.size() && pairs[likely].m_indexA == a && pairs[likely].m_indexB == b)
            return likely;
        const btSimplePair* const found = cache.findPair(a, b);
        return found == nullptr ? -1 : static_cast<int>(found - &pairs[0]);
    }

    /// Forgets a pair, whose place the last one takes.
    void remove(int a, int b)
    {
        states.swap(find(a, b, 0), states.size() - 1);
        states.pop_back();
        cache.removeOverlappingPair(a, b);
    }
};

/// One call, in which pairs of children are visited in the order of both trees.
class CompoundPairAlgorithm::Pass
{
public:
    Pass(CompoundPairAlgorithm& algorithm, Pairs& pairs, const btCollisionObjectWrapper& a,
         const btCollisionObjectWrapper& b, const btDispatcherInfo& info, btManifoldResult& result)
        : m_algorithm(algorithm),
          m_pairs(pairs),
          m_a(a),
          m_b(b),
          m_info(info),
          m_result(result),
          m_distance(result.m_closestPointDistanceThreshold)
    {
    }

    void run()
    {
        const TreeBoxTest overlap(m_a.getWorldTransform().inverse() * m_b.getWorldTransform(), m_distance);
        forEachLeafPair(compoundOf(m_a).getDynamicAabbTree()->m_root,
                        compoundOf(m_b).getDynamicAabbTree()->m_root, overlap,
                        [this](int childOfA, int childOfB) { visit(childOfA, childOfB); });
    }

    bool isNear(const btSimplePair& pair) const
    {
        PlacedChild a, b;
        a.place(m_a, pair.m_indexA);
        b.place(m_b, pair.m_indexB);
        // Bullet grows both boxes here.
        return areNear(a, b, 2 * m_distance);
    }

private:
    static bool areNear(const PlacedChild& a, const PlacedChild& b, btScalar distance)
    {
        const btVector3 around(distance, distance, distance);
        return b.overlaps(a.low - around, a.high + around);
    }

    void visit(int childOfA, int childOfB)
    {
        // Neighbours in the order of the trees often share a child.
        if (m_childA.index != childOfA)
            m_childA.place(m_a, childOfA);
        if (m_childB.index != childOfB)
            m_childB.place(m_b, childOfB);
        if (gCompoundCompoundChildShapePairCallback != nullptr &&
            !gCompoundCompoundChildShapePairCallback(m_childA.shape, m_childB.shape))
            return;
        if (!areNear(m_childA, m_childB, m_distance))
            return;
        const btCollisionObjectWrapper wrapA(&m_a, m_childA.shape, m_a.getCollisionObject(), m_childA.at, -1,
                                             childOfA);
        const btCollisionObjectWrapper wrapB(&m_b, m_childB.shape, m_b.getCollisionObject(), m_childB.at, -1,
                                             childOfB);
        if (m_distance > 0)
            return processOnce(wrapA, wrapB);
        const int place = placeOf(wrapA, wrapB);
        m_next = place + 1;
        m_pairs.states[place].isProcessed = true;
        process(algorithmOf(m_pairs.array()[place]), wrapA, wrapB);
    }

    /// The place of a pair in the array.
    int placeOf(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b)
    {
        const btCollisionShape &shapeA = *a.getCollisionShape(), &shapeB = *b.getCollisionShape();
        int place = m_pairs.find(a.m_index, b.m_index, m_next);
        if (place >= 0 && fits(m_pairs.states[place], shapeA, shapeB))
            return place;
        if (place >= 0)
        {
            destroy(algorithmOf(m_pairs.array()[place]), *m_algorithm.m_dispatcher);
            m_pairs.remove(a.m_index, b.m_index);
        }
        return make(a, b);
    }

    /// @return the place of a new pair
    int make(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b)
    {
        m_pairs.states.push_back(ChildState());
        const int place = m_pairs.states.size() - 1;
        try
        {
            m_pairs.cache.addOverlappingPair(a.m_index, b.m_index);
            btCollisionAlgorithm* const made = m_algorithm.m_dispatcher->findAlgorithm(
                &a, &b, m_algorithm.m_sharedManifold, BT_CONTACT_POINT_ALGORITHMS);
            m_pairs.array()[place].m_userPointer = made;
            m_pairs.states[place] = stateOf(*made, *a.getCollisionShape(), *b.getCollisionShape(),
                                            m_algorithm.m_sharedManifold != nullptr);
        }
        catch (...)
        {
            // The cache may hold half of the pair: processCollision() forgets all.
            m_pairs.states.pop_back();
            throw;
        }
        return place;
    }

    /// For a query with a distance, with an algorithm of its own.
    void processOnce(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b)
    {
        btDispatcher& dispatcher = *m_algorithm.m_dispatcher;
        const auto destroyIt = [&dispatcher](btCollisionAlgorithm* made) { destroy(*made, dispatcher); };
        const std::unique_ptr<btCollisionAlgorithm, decltype(destroyIt)> algorithm(
            dispatcher.findAlgorithm(&a, &b, nullptr, BT_CLOSEST_POINT_ALGORITHMS), destroyIt);
        process(*algorithm, a, b);
    }

    void process(btCollisionAlgorithm& algorithm, const btCollisionObjectWrapper& a,
                 const btCollisionObjectWrapper& b)
    {
        const btCollisionObjectWrapper *const outerA = m_result.getBody0Wrap(), *const outerB =
                                                                                    m_result.getBody1Wrap();
        m_result.setBody0Wrap(&a);
        m_result.setBody1Wrap(&b);
        m_result.setShapeIdentifiersA(-1, a.m_index);
        m_result.setShapeIdentifiersB(-1, b.m_index);
        algorithm.processCollision(&a, &b, m_info, &m_result);
        m_result.setBody0Wrap(outerA);
        m_result.setBody1Wrap(outerB);
    }

    CompoundPairAlgorithm& m_algorithm;
    Pairs& m_pairs;
    const btCollisionObjectWrapper& m_a;
    const btCollisionObjectWrapper& m_b;
    const btDispatcherInfo& m_info;
    btManifoldResult& m_result;
    const btScalar m_distance;
    PlacedChild m_childA, m_childB;  ///< of the last visit
    int m_next = 0;                  ///< likely place of the next pair
};

CompoundPairAlgorithm::CompoundPairAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                             const btCollisionObjectWrapper* a,
                                             const btCollisionObjectWrapper* b)
    : CompoundAlgorithm(info, a, b, false)
{
}

CompoundPairAlgorithm::~CompoundPairAlgorithm()
{
    clearPairs();
}

void CompoundPairAlgorithm::clearPairs()
{
    if (m_pairs == nullptr)
        return;
    for (int i = 0; i < m_pairs->states.size(); ++i)
        destroy(algorithmOf(m_pairs->array()[i]), *m_dispatcher);
    m_pairs.reset();
}

/// The pairs of children with an algorithm, none after a change of the list of children.
CompoundPairAlgorithm::Pairs& CompoundPairAlgorithm::pairs(const btCompoundShape& a, const btCompoundShape& b)
{
    if (m_pairs != nullptr &&
        (a.getUpdateRevision() != m_pairs->revisionA || a.getNumChildShapes() != m_pairs->countA ||
         b.getUpdateRevision() != m_pairs->revisionB || b.getNumChildShapes() != m_pairs->countB))
        clearPairs();
    if (m_pairs == nullptr)
    {
        m_pairs = std::make_unique<Pairs>();
        m_pairs->revisionA = a.getUpdateRevision();
        m_pairs->revisionB = b.getUpdateRevision();
        m_pairs->countA = a.getNumChildShapes();
        m_pairs->countB = b.getNumChildShapes();
    }
    return *m_pairs;
}

/// Refreshes the manifolds of algorithms that do not do so themselves.
void CompoundPairAlgorithm::refreshFirst(Pairs& pairs, btManifoldResult& result)
{
    ManifoldRefresh refresh(result);
    const bool refreshesAll = seesEndsOfContacts();
    for (int i = 0; i < pairs.states.size(); ++i)
    {
        pairs.states[i].isProcessed = false;
        if (refreshesAll || !refreshesItself(pairs.states[i].kind))
            refresh(algorithmOf(pairs.array()[i]));
    }
}

/// Destroys the algorithms of pairs that are far, and refreshes the others that were not processed.
void CompoundPairAlgorithm::destroyFarPairs(Pairs& pairs, const Pass& pass, btManifoldResult& result)
{
    ManifoldRefresh refresh(result);
    btSimplePairArray far;
    for (int i = 0; i < pairs.states.size(); ++i)
    {
        const btSimplePair& pair = pairs.array()[i];
        if (pairs.states[i].isProcessed)
            continue;
        if (!pass.isNear(pair))
            far.push_back(pair);
        else if (refreshesItself(pairs.states[i].kind))
            refresh(algorithmOf(pair));
    }
    for (int i = 0; i < far.size(); ++i)
        destroy(algorithmOf(far[i]), *m_dispatcher);
    for (int i = 0; i < far.size(); ++i)
        pairs.remove(far[i].m_indexA, far[i].m_indexB);
}

void CompoundPairAlgorithm::processCollision(const btCollisionObjectWrapper* a,
                                             const btCollisionObjectWrapper* b, const btDispatcherInfo& info,
                                             btManifoldResult* result)
{
    // The bodies' shapes may have been exchanged.
    const bool areCompounds = a->getCollisionShape()->isCompound() && b->getCollisionShape()->isCompound();
    if (!areCompounds || compoundOf(*a).getDynamicAabbTree() == nullptr ||
        compoundOf(*b).getDynamicAabbTree() == nullptr)
    {
        clearPairs();
        return CompoundAlgorithm::processCollision(a, b, info, result);
    }
    clearChildren();
    CompoundRest::Call call(rest());
    process(*a, *b, info, *result);
    call.end([this] { return hasContacts(); });
}

/// @pre both are compounds with trees
void CompoundPairAlgorithm::process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                                    const btDispatcherInfo& info, btManifoldResult& result)
{
    try
    {
        Pairs& own = pairs(compoundOf(a), compoundOf(b));
        refreshFirst(own, result);
        Pass pass(*this, own, a, b, info, result);
        pass.run();
        destroyFarPairs(own, pass, result);
    }
    catch (...)
    {
        // Bullet's cache is not whole after its allocator has thrown.
        clearPairs();
        throw;
    }
}

void CompoundPairAlgorithm::getAllContactManifolds(btManifoldArray& manifolds)
{
    CompoundAlgorithm::getAllContactManifolds(manifolds);
    for (int i = 0; m_pairs != nullptr && i < m_pairs->states.size(); ++i)
        algorithmOf(m_pairs->array()[i]).getAllContactManifolds(manifolds);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
