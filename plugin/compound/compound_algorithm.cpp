// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/compound/compound_algorithm.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/mesh_algorithm.h"
#include "cullet/plugin/mesh/mesh_region.h"

#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <limits>
#include <new>
#include <optional>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Proves that boxes are far from a plane.
class PlaneBound
{
public:
    PlaneBound(const btStaticPlaneShape& plane, const btTransform& at)
        : m_normal(at.getBasis() * plane.getPlaneNormal()),
          m_magnitudes(m_normal.absolute()),
          m_height(plane.getPlaneConstant() + m_normal.dot(at.getOrigin())),
          m_size(btFabs(plane.getPlaneConstant()) + m_magnitudes.dot(at.getOrigin().absolute()))
    {
    }

    /// Whether no point of a box is within a distance over the plane, by more than rounding. False for a NaN.
    bool isFar(const btVector3& low, const btVector3& high, btScalar distance) const
    {
        const btVector3 centre = (low + high) * btScalar(0.5), half = (high - low) * btScalar(0.5);
        const btScalar least = m_normal.dot(centre) - m_magnitudes.dot(half) - m_height;
        const btScalar size = m_size + m_magnitudes.dot(centre.absolute() + half);
        return least > distance + 32 * std::numeric_limits<btScalar>::epsilon() * size;
    }

private:
    const btVector3 m_normal, m_magnitudes;
    const btScalar m_height, m_size;
};
/// The triangles of a mesh near a compound. Children where there are none have no contacts.
class MeshBound
{
public:
    /// @param region to use; its memory is kept between calls
    MeshBound(const btCollisionObjectWrapper& compound, const btCollisionObjectWrapper& mesh,
              MeshRegion& region)
        : m_region(region),
          m_fromWorld(mesh.getWorldTransform().inverse()),
          m_margin(mesh.getCollisionShape()->getMargin())
    {
        const Box box = boxOf(*compound.getCollisionShape(), compound.getWorldTransform());
        // Room for what rounding adds to boxes of children.
        const btVector3 more = (box.high - box.low) * kMore;
        m_region.find(static_cast<const btConcaveShape&>(*mesh.getCollisionShape()), box.low - more,
                      box.high + more, kMostLeaves);
    }

    MeshRegion& region() { return m_region; }

    /// Whether the mesh has no triangle in a child's box.
    bool isFar(const PlacedChild& child) const
    {
        const Box box = boxOf(*child.shape, child.at);
        return m_region.covers(box.low, box.high) && !m_region.hasTriangles(box.low, box.high);
    }

private:
    /// A compound with more triangles around it is large or sparse: most are far from all children.
    static constexpr std::size_t kMostLeaves = 256;
    static constexpr btScalar kMore = btScalar(0.01);

    struct Box
    {
        btVector3 low, high;
    };

    /// The box in which a child's algorithm asks for triangles, with the same bits.
    Box boxOf(const btCollisionShape& shape, const btTransform& at) const
    {
        const btVector3 margin(m_margin, m_margin, m_margin);
        Box box;
        shape.getAabb(m_fromWorld * at, box.low, box.high);
        return {box.low - margin, box.high + margin};
    }

    MeshRegion& m_region;
    const btTransform m_fromWorld;
    const btScalar m_margin;
};
}  // namespace

struct CompoundAlgorithm::Children
{
    /// With fewer, to search a region costs as much as it saves.
    static constexpr int kFewForRegion = 3;

    btAlignedObjectArray<ChildState> states;  ///< of each child with an algorithm
    btAlignedObjectArray<int> live;           ///< children with an algorithm, ascending between calls
    bool isAscending = true;                  ///< live is
    MeshRegion region;                        ///< of one call; its memory is kept
};

/// One call, whose children are visited in the order of the compound's tree.
class CompoundAlgorithm::Pass : public btDbvt::ICollide
{
public:
    Pass(CompoundAlgorithm& algorithm, Children& children, const btCollisionObjectWrapper& compound,
         const btCollisionObjectWrapper& other, const btDispatcherInfo& info, btManifoldResult& result)
        : m_algorithm(algorithm),
          m_children(children),
          m_compound(compound),
          m_other(other),
          m_info(info),
          m_result(result)
    {
        const btCollisionShape& shape = *other.getCollisionShape();
        shape.getAabb(other.getWorldTransform(), m_low, m_high);
        if (isExactly<btStaticPlaneShape>(shape))
            m_plane.emplace(static_cast<const btStaticPlaneShape&>(shape), other.getWorldTransform());
        if (shape.isConcave() && children.live.size() > Children::kFewForRegion)
            m_mesh.emplace(compound, other, children.region);
    }

    void run()
    {
        const btDbvt* const tree = shape().getDynamicAabbTree();
        if (tree == nullptr)
        {
            for (int i = 0; i < shape().getNumChildShapes(); ++i)
                visit(i);
            return;
        }
        btVector3 low, high;
        m_other.getCollisionShape()->getAabb(
            m_compound.getWorldTransform().inverse() * m_other.getWorldTransform(), low, high);
        tree->collideTV(tree->m_root, btDbvtVolume::FromMM(low, high), *this);
    }

    void Process(const btDbvtNode* leaf) override { visit(leaf->dataAsInt); }

    bool isNear(int index) const
    {
        PlacedChild child;
        child.place(m_compound, index);
        return child.overlaps(m_low, m_high);
    }

private:
    const btCompoundShape& shape() const
    {
        return static_cast<const btCompoundShape&>(*m_compound.getCollisionShape());
    }

    void visit(int index)
    {
        if (gCompoundChildShapePairCallback != nullptr &&
            !gCompoundChildShapePairCallback(m_other.getCollisionShape(), shape().getChildShape(index)))
            return;
        PlacedChild child;
        child.place(m_compound, index);
        if (!child.overlaps(m_low, m_high))
            return;
        btTransform before = shape().getChildTransform(index);
        if (m_compound.m_preTransform != nullptr)
            before = before * *m_compound.m_preTransform;
        const btCollisionObjectWrapper wrap(&m_compound, child.shape, m_compound.getCollisionObject(),
                                            child.at, before, -1, index);
        btCollisionAlgorithm* const algorithm = algorithmOf(wrap);
        ChildState& state = m_children.states[index];
        state.isProcessed = true;
        if (state.mayTouch || !isFar(child, state))
            process(*algorithm, wrap, state);
    }

    /// Whether a child whose manifold has no contacts gets none.
    bool isFar(const PlacedChild& child, const ChildState& state) const
    {
        if (m_plane)
            return m_plane->isFar(child.low, child.high, state.breakingThreshold);
        return m_mesh && m_mesh->isFar(child);
    }

    btCollisionAlgorithm* algorithmOf(const btCollisionObjectWrapper& wrap)
    {
        const int index = wrap.m_index;
        btCollisionAlgorithm*& algorithm = m_algorithm.m_childCollisionAlgorithms[index];
        const btCollisionShape &a = *wrap.getCollisionShape(), &b = *m_other.getCollisionShape();
        if (algorithm != nullptr && fits(m_children.states[index], a, b))
            return algorithm;
        if (algorithm != nullptr)
        {
            m_children.live.remove(index);
            destroy(*std::exchange(algorithm, nullptr), *m_algorithm.m_dispatcher);
        }
        m_children.isAscending = false;
        // Before the algorithm is created, since it may throw.
        m_children.live.push_back(index);
        m_children.live.pop_back();
        algorithm = m_algorithm.m_dispatcher->findAlgorithm(&wrap, &m_other, m_algorithm.m_sharedManifold,
                                                            BT_CONTACT_POINT_ALGORITHMS);
        m_children.live.push_back(index);
        m_children.states[index] = stateOf(*algorithm, a, b, m_algorithm.m_sharedManifold != nullptr);
        return algorithm;
    }

    void process(btCollisionAlgorithm& algorithm, const btCollisionObjectWrapper& wrap, ChildState& state)
    {
        const bool isFirst = m_result.getBody0Internal() == m_compound.getCollisionObject();
        const btCollisionObjectWrapper* const outer =
            isFirst ? m_result.getBody0Wrap() : m_result.getBody1Wrap();
        if (isFirst)
        {
            m_result.setBody0Wrap(&wrap);
            m_result.setShapeIdentifiersA(-1, wrap.m_index);
        }
        else
        {
            m_result.setBody1Wrap(&wrap);
            m_result.setShapeIdentifiersB(-1, wrap.m_index);
        }
        state.mayTouch = true;
        m_result.setPersistentManifold(nullptr);
        if (m_mesh && state.kind == ChildKind::Mesh)
            static_cast<MeshAlgorithm&>(algorithm).processNear(m_mesh->region(), wrap, m_other, m_info,
                                                               m_result);
        else
            algorithm.processCollision(&wrap, &m_other, m_info, &m_result);
        isFirst ? m_result.setBody0Wrap(outer) : m_result.setBody1Wrap(outer);
        const bool mayBeFar = state.kind == ChildKind::Plane || state.kind == ChildKind::Mesh;
        if (mayBeFar && m_result.getPersistentManifold() != nullptr)
        {
            const btPersistentManifold& manifold = *m_result.getPersistentManifold();
            state.mayTouch = manifold.getNumContacts() > 0;
            state.breakingThreshold = manifold.getContactBreakingThreshold();
        }
    }

    CompoundAlgorithm& m_algorithm;
    Children& m_children;
    const btCollisionObjectWrapper& m_compound;
    const btCollisionObjectWrapper& m_other;
    const btDispatcherInfo& m_info;
    btManifoldResult& m_result;
    btVector3 m_low, m_high;  ///< the box of the other shape
    std::optional<PlaneBound> m_plane;
    std::optional<MeshBound> m_mesh;
};

CompoundAlgorithm::CompoundAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                     const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                     bool isSwapped)
    : btCompoundCollisionAlgorithm(info, a, b, isSwapped)
{
}

CompoundAlgorithm::~CompoundAlgorithm() = default;

void CompoundAlgorithm::clearChildren()
{
    removeChildAlgorithms();
    m_childCollisionAlgorithms.resizeNoInitialize(0);
    m_children.reset();
}

/// Follows changes of the list of children.
void CompoundAlgorithm::updateChildren(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b)
{
    const btCollisionObjectWrapper& compound = m_isSwapped ? b : a;
    const auto& shape = static_cast<const btCompoundShape&>(*compound.getCollisionShape());
    if (shape.getUpdateRevision() == m_compoundShapeRevision &&
        shape.getNumChildShapes() == m_childCollisionAlgorithms.size())
        return;
    clearChildren();
    preallocateChildAlgorithms(&a, &b);
    m_compoundShapeRevision = shape.getUpdateRevision();
}

/// @return null if out of memory
CompoundAlgorithm::Children* CompoundAlgorithm::children(const btCollisionObjectWrapper& compound,
                                                         const btCollisionObjectWrapper& other)
{
    if (m_children != nullptr)
        return m_children.get();
    std::unique_ptr<Children> made(new (std::nothrow) Children);
    if (made == nullptr)
        return nullptr;
    const auto& shape = static_cast<const btCompoundShape&>(*compound.getCollisionShape());
    const int count = m_childCollisionAlgorithms.size();
    made->states.resize(count);
    for (int i = 0; i < count; ++i)
    {
        if (m_childCollisionAlgorithms[i] == nullptr)
            continue;
        made->live.push_back(i);
        made->states[i] = stateOf(*m_childCollisionAlgorithms[i], *shape.getChildShape(i),
                                  *other.getCollisionShape(), m_sharedManifold != nullptr);
    }
    // Complete, since Bullet's allocator may throw meanwhile.
    m_children = std::move(made);
    return m_children.get();
}

/// Refreshes the manifolds of algorithms that do not do so themselves.
void CompoundAlgorithm::refreshFirst(Children& children, btManifoldResult& result)
{
    ManifoldRefresh refresh(result);
    const bool refreshesAll = seesEndsOfContacts();
    for (int i = 0; i < children.live.size(); ++i)
    {
        ChildState& state = children.states[children.live[i]];
        state.isProcessed = false;
        if (refreshesItself(state.kind) ? refreshesAll : state.mayTouch)
            refresh(*m_childCollisionAlgorithms[children.live[i]]);
    }
}

void CompoundAlgorithm::destroyFarChildren(Children& children, const Pass& pass, btManifoldResult& result)
{
    if (!children.isAscending)
        children.live.quickSort([](int a, int b) { return a < b; });
    children.isAscending = true;
    ManifoldRefresh refresh(result);
    int kept = 0;
    for (int i = 0; i < children.live.size(); ++i)
    {
        const int index = children.live[i];
        btCollisionAlgorithm*& algorithm = m_childCollisionAlgorithms[index];
        const ChildState& state = children.states[index];
        if (!state.isProcessed && !pass.isNear(index))
        {
            destroy(*std::exchange(algorithm, nullptr), *m_dispatcher);
            continue;
        }
        if (!state.isProcessed && refreshesItself(state.kind))
            refresh(*algorithm);
        children.live[kept++] = index;
    }
    children.live.resizeNoInitialize(kept);
}

void CompoundAlgorithm::processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                                         const btDispatcherInfo& info, btManifoldResult* result)
{
    CompoundRest::Call call(m_rest);
    process(*a, *b, info, *result);
    call.end([this] { return hasContacts(); });
}

void CompoundAlgorithm::process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                                const btDispatcherInfo& info, btManifoldResult& result)
{
    const btCollisionObjectWrapper &compound = m_isSwapped ? b : a, &other = m_isSwapped ? a : b;
    // The body's shape may have been exchanged.
    if (!compound.getCollisionShape()->isCompound())
        return clearChildren();
    updateChildren(a, b);
    const bool isStep = result.m_closestPointDistanceThreshold == 0 && isExactly<btManifoldResult>(result);
    Children* const own = isStep ? children(compound, other) : nullptr;
    if (own == nullptr)
    {
        m_children.reset();
        return btCompoundCollisionAlgorithm::processCollision(&a, &b, info, &result);
    }
    if (m_childCollisionAlgorithms.size() == 0)
        return;
    refreshFirst(*own, result);
    Pass pass(*this, *own, compound, other, info, result);
    pass.run();
    destroyFarChildren(*own, pass, result);
}

bool CompoundAlgorithm::hasContacts()
{
    btManifoldArray manifolds;
    getAllContactManifolds(manifolds);
    bool hasAny = false;
    for (int i = 0; i < manifolds.size(); ++i)
        hasAny |= manifolds[i]->getNumContacts() > 0;
    return hasAny;
}

void CompoundAlgorithm::getAllContactManifolds(btManifoldArray& manifolds)
{
    // Bullet's importer calls this to put saved points into manifolds.
    m_rest.forget();
    if (m_children == nullptr)
        return btCompoundCollisionAlgorithm::getAllContactManifolds(manifolds);
    for (int i = 0; i < m_children->live.size(); ++i)
    {
        const int index = m_children->live[i];
        // The next step must refresh points that are put into the manifold.
        m_children->states[index].mayTouch = true;
        m_childCollisionAlgorithms[index]->getAllContactManifolds(manifolds);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
