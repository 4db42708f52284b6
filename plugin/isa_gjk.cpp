// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/isa_gjk.h"

#include "cullet/base/held_while_forking.h"
#include "cullet/broad/log.h"
#include "cullet/plugin/compound/compound_pair_algorithm.h"
#include "cullet/plugin/convex/body_motions.h"
#include "cullet/plugin/convex/box_box_algorithm.h"
#include "cullet/plugin/convex/isa_gjk_algorithm.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/mesh_algorithm.h"
#include "cullet/plugin/shapes/convex_shape.h"

#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSphereTriangleCollisionAlgorithm.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Pass numbers are unique in the process, so that a check of a shape in one pass is not valid in another world's.
std::atomic<std::uint64_t> lastPass{0};

/// Pass numbers that a dispatcher takes at once: a shared counter costs more than a small world has to spend in a step.
constexpr std::uint64_t kPassesAtOnce = 1024;

bool isRound(ConvexKind kind)
{
    return kind == ConvexKind::Sphere || kind == ConvexKind::Capsule;
}

/// Whether ISA-GJK takes over a pair of types.
bool isCovered(int typeA, int typeB, const IsaGjkOptions& options)
{
    const ConvexKind a = convexKindOf(typeA), b = convexKindOf(typeB);
    if (a == ConvexKind::Unsupported || b == ConvexKind::Unsupported || (isRound(a) && isRound(b)))
        return false;
    const bool isSphereTriangle = (a == ConvexKind::Sphere && b == ConvexKind::Triangle) ||
                                  (a == ConvexKind::Triangle && b == ConvexKind::Sphere);
    const bool isBoxBox = a == ConvexKind::Box && b == ConvexKind::Box;
    return !isSphereTriangle && (!isBoxBox || options.boxPairs == BoxPairs::IsaGjk);
}

/// The options, clamped to their ranges.
IsaGjkOptions checkedOptions(const IsaGjkOptions& options)
{
    IsaGjkOptions checked = options;
    checked.patchPoints = std::clamp(options.patchPoints, 1, 4);
    if (checked.patchPoints != options.patchPoints)
    {
        char text[96];
        std::snprintf(text, sizeof(text), "%d points per patch: 1 to 4 are possible; %d is used",
                      options.patchPoints, checked.patchPoints);
        log(LogLevel::Warning, text);
    }
    return checked;
}

/// Restores the algorithms of the configuration for a pair of types.
void giveBack(int typeA, int typeB, btCollisionDispatcher& dispatcher,
              btCollisionConfiguration& configuration)
{
    dispatcher.registerCollisionCreateFunc(typeA, typeB,
                                           configuration.getCollisionAlgorithmCreateFunc(typeA, typeB));
    dispatcher.registerClosestPointsCreateFunc(
        typeA, typeB, configuration.getClosestPointsAlgorithmCreateFunc(typeA, typeB));
}

/// The convex types whose loop over triangles MeshAlgorithm takes over, and the concave types whose triangles it reads.
constexpr int kMeshConvexTypes[] = {CONVEX_HULL_SHAPE_PROXYTYPE,  BOX_SHAPE_PROXYTYPE,
                                    CAPSULE_SHAPE_PROXYTYPE,      SPHERE_SHAPE_PROXYTYPE,
                                    CYLINDER_SHAPE_PROXYTYPE,     CONE_SHAPE_PROXYTYPE,
                                    MULTI_SPHERE_SHAPE_PROXYTYPE, CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE};
constexpr int kMeshConcaveTypes[] = {TRIANGLE_MESH_SHAPE_PROXYTYPE, SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE,
                                     TERRAIN_SHAPE_PROXYTYPE, MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE,
                                     FAST_CONCAVE_MESH_PROXYTYPE};

/// Calls call(convex type, concave type) for each pair of these.
template <class Call>
void forEachMeshPair(const Call& call)
{
    for (const int convex : kMeshConvexTypes)
    {
        for (const int concave : kMeshConcaveTypes)
            call(convex, concave);
    }
}

/// Whether the configuration has Bullet's own loop over triangles for a pair of types.
bool hasBulletsLoop(btCollisionConfiguration& configuration, int typeA, int typeB)
{
    const btCollisionAlgorithmCreateFunc& create =
        *configuration.getCollisionAlgorithmCreateFunc(typeA, typeB);
    return isExactly<btConvexConcaveCollisionAlgorithm::CreateFunc>(create) ||
           isExactly<btConvexConcaveCollisionAlgorithm::SwappedCreateFunc>(create);
}

/// The table of a dispatcher, which Bullet shows to derived classes only.
struct Table : btCollisionDispatcher
{
    static const btCollisionAlgorithmCreateFunc* of(const btCollisionDispatcher& dispatcher, int a, int b)
    {
        return (dispatcher.*(&Table::m_doubleDispatchContactPoints))[a][b];
    }
};

/// Calls call(type, type) for each pair of types of which one at least is a compound's.
template <class Call>
void forEachCompoundPair(const Call& call)
{
    for (int other = 0; other < MAX_BROADPHASE_COLLISION_TYPES; ++other)
    {
        call(COMPOUND_SHAPE_PROXYTYPE, other);
        if (other != COMPOUND_SHAPE_PROXYTYPE)
            call(other, COMPOUND_SHAPE_PROXYTYPE);
    }
}
}  // namespace

IsaGjkRegistration::IsaGjkRegistration(btCollisionDispatcher& dispatcher, const IsaGjkOptions& options)
    : m_motions(std::make_unique<BodyMotions>())
{
    reset(dispatcher, options);
}

IsaGjkRegistration::~IsaGjkRegistration() = default;

void IsaGjkRegistration::reset(btCollisionDispatcher& dispatcher, const IsaGjkOptions& options)
{
    m_leftTotal.load(std::memory_order_acquire);
    btCollisionConfiguration& configuration = *dispatcher.getCollisionConfiguration();
    if (m_options.boxPairs != options.boxPairs)
        giveBack(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, dispatcher, configuration);
    m_dispatcher = &dispatcher;
    if (m_options.meshes && !options.meshes)
        giveBackMeshes();
    if (m_options.compounds && !options.compounds)
        giveBackCompounds();
    m_options = checkedOptions(options);
    ++m_resets;
    endPass();
    for (ThreadCounter* counter : {&m_counters.separated, &m_counters.touching, &m_counters.depths,
                                   &m_counters.notConverged, &m_counters.delegated, &m_counters.exact,
                                   &m_counters.triangles, &m_counters.trianglesAsked, &m_counters.reused})
        counter->reset();
    m_stockBoxes = configuration.getCollisionAlgorithmCreateFunc(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE);
    m_stock =
        dynamicCast<const btConvexConvexAlgorithm::CreateFunc>(configuration.getCollisionAlgorithmCreateFunc(
            CONVEX_HULL_SHAPE_PROXYTYPE, CONVEX_HULL_SHAPE_PROXYTYPE));
    if (m_stock == nullptr)
        m_stock = &m_ownStock;
}

void IsaGjkRegistration::registerWith(btCollisionDispatcher& dispatcher)
{
    for (int a = 0; a < CONCAVE_SHAPES_START_HERE; ++a)
    {
        for (int b = 0; b < CONCAVE_SHAPES_START_HERE; ++b)
        {
            if (!isCovered(a, b, m_options))
                continue;
            dispatcher.registerCollisionCreateFunc(a, b, &m_contactPoints);
            dispatcher.registerClosestPointsCreateFunc(a, b, &m_closestPoints);
        }
    }
    if (m_options.boxPairs == BoxPairs::SeparatingAxes)
        dispatcher.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, &m_boxes);
    if (m_options.meshes)
        registerMeshes(dispatcher);
    if (m_options.compounds)
        registerCompounds(dispatcher);
}

/// Replaces Bullet's own algorithms. Those of another library, as GImpact's, stay.
void IsaGjkRegistration::registerCompounds(btCollisionDispatcher& dispatcher)
{
    forEachCompoundPair(
        [&](int a, int b)
        {
            const btCollisionAlgorithmCreateFunc& create = *Table::of(dispatcher, a, b);
            if (isExactly<btCompoundCompoundCollisionAlgorithm::CreateFunc>(create))
                dispatcher.registerCollisionCreateFunc(a, b, &m_compoundPairs);
            else if (isExactly<btCompoundCollisionAlgorithm::CreateFunc>(create))
                dispatcher.registerCollisionCreateFunc(a, b, &m_compounds);
            else if (isExactly<btCompoundCollisionAlgorithm::SwappedCreateFunc>(create))
                dispatcher.registerCollisionCreateFunc(a, b, &m_swappedCompounds);
        });
}

void IsaGjkRegistration::giveBackCompounds()
{
    btCollisionConfiguration& configuration = *m_dispatcher->getCollisionConfiguration();
    forEachCompoundPair(
        [&](int a, int b)
        {
            if (makesCompounds(Table::of(*m_dispatcher, a, b)))
                m_dispatcher->registerCollisionCreateFunc(
                    a, b, configuration.getCollisionAlgorithmCreateFunc(a, b));
        });
}

bool IsaGjkRegistration::isOfCompound(const btCollisionAlgorithm& algorithm)
{
    return isExactly<CompoundAlgorithm>(algorithm) || isExactly<CompoundPairAlgorithm>(algorithm);
}

btCollisionAlgorithm* IsaGjkRegistration::CompoundCreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b)
{
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(CompoundAlgorithm));
    return new (memory) CompoundAlgorithm(info, a, b, m_swapped);
}

btCollisionAlgorithm* IsaGjkRegistration::CompoundPairCreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b)
{
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(CompoundPairAlgorithm));
    return new (memory) CompoundPairAlgorithm(info, a, b);
}

void IsaGjkRegistration::registerMeshes(btCollisionDispatcher& dispatcher)
{
    btCollisionConfiguration& configuration = *dispatcher.getCollisionConfiguration();
    forEachMeshPair(
        [&](int convex, int concave)
        {
            if (hasBulletsLoop(configuration, convex, concave))
                dispatcher.registerCollisionCreateFunc(convex, concave, &m_meshes);
            if (hasBulletsLoop(configuration, concave, convex))
                dispatcher.registerCollisionCreateFunc(concave, convex, &m_swappedMeshes);
        });
}

void IsaGjkRegistration::giveBackMeshes()
{
    btCollisionConfiguration& configuration = *m_dispatcher->getCollisionConfiguration();
    forEachMeshPair(
        [&](int convex, int concave)
        {
            giveBack(convex, concave, *m_dispatcher, configuration);
            giveBack(concave, convex, *m_dispatcher, configuration);
        });
}

bool IsaGjkRegistration::isOfMesh(const btCollisionAlgorithm& algorithm)
{
    return isExactly<MeshAlgorithm>(algorithm);
}

bool IsaGjkRegistration::answersTriangles(int convexType) const
{
    const btCollisionAlgorithmCreateFunc* const create =
        Table::of(*m_dispatcher, convexType, TRIANGLE_SHAPE_PROXYTYPE);
    return convexType == SPHERE_SHAPE_PROXYTYPE
               ? isExactly<btSphereTriangleCollisionAlgorithm::CreateFunc>(*create)
               : create == &m_contactPoints;
}

btCollisionAlgorithm* IsaGjkRegistration::MeshCreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b)
{
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(MeshAlgorithm));
    return new (memory) MeshAlgorithm(m_isaGjk, info, a, b, m_swapped);
}

btCollisionAlgorithm* IsaGjkRegistration::BoxCreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b)
{
    if (!isExactly<btBoxShape>(*a->getCollisionShape()) || !isExactly<btBoxShape>(*b->getCollisionShape()))
        return m_isaGjk.m_stockBoxes->CreateCollisionAlgorithm(info, a, b);
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(BoxBoxAlgorithm));
    return new (memory) BoxBoxAlgorithm(m_isaGjk, info.m_manifold, info, a, b);
}

void IsaGjkRegistration::beginPass()
{
    if (!m_options.checkPoints)
        return;
    if (m_lastPass == m_endOfPasses)
    {
        m_lastPass = lastPass.fetch_add(kPassesAtOnce, std::memory_order_relaxed);
        m_endOfPasses = m_lastPass + kPassesAtOnce;
    }
    m_pass = ++m_lastPass;
}

IsaGjkStats IsaGjkRegistration::stats() const
{
    IsaGjkStats stats;
    stats.separatedTotal = m_counters.separated.value();
    stats.touchingTotal = m_counters.touching.value();
    stats.depthsTotal = m_counters.depths.value();
    stats.notConvergedTotal = m_counters.notConverged.value();
    stats.delegatedTotal = m_counters.delegated.value();
    stats.exactTotal = m_counters.exact.value();
    stats.trianglesTotal = m_counters.triangles.value();
    stats.trianglesAskedTotal = m_counters.trianglesAsked.value();
    stats.reusedTotal = m_counters.reused.value();
    return stats;
}

btCollisionAlgorithm* IsaGjkRegistration::CreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b)
{
    // The algorithm is symmetric, so that one function serves both orders of a pair of types.
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(IsaGjkAlgorithm));
    return new (memory) IsaGjkAlgorithm(m_isaGjk, info.m_manifold, info, a, b, m_closestOnly);
}

IsaGjkRegistration& registerIsaGjk(btCollisionDispatcher& dispatcher, IsaGjkOptions options)
{
    // Create functions must outlive dispatcher and world, and Bullet does not report when these are destroyed. So they
    // are never destroyed, and there is one per address.
    static std::mutex mutex;
    [[maybe_unused]] static const bool isHeld = (holdWhileForking(mutex), true);
    static auto& known = *new std::map<btCollisionDispatcher*, std::unique_ptr<IsaGjkRegistration>>;
    // Before the lock: it may log, and a logger of the application may fork.
    const IsaGjkOptions checked = checkedOptions(options);
    const std::lock_guard<std::mutex> lock(mutex);
    std::unique_ptr<IsaGjkRegistration>& isaGjk = known[&dispatcher];
    if (isaGjk)
        isaGjk->reset(dispatcher, checked);
    else
        isaGjk = std::make_unique<IsaGjkRegistration>(dispatcher, checked);
    isaGjk->registerWith(dispatcher);
    return *isaGjk;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
