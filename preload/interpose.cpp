// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The functions of Bullet that a program binds to this library first. Constructors decide whether cullet takes over.
// The others are necessary because a compiler that knows the type of an object calls them without its virtual table,
// and because the table in Bullet's library refers to them too; they distinguish a stand-in from Bullet's own object
// by its table.
//
// Objects are passed as addresses only, so that the code is the same for both precisions; Bullet's headers only declare
// the names.

#include "cullet/preload/bullet_library.h"
#include "cullet/preload/exported.h"
#include "cullet/preload/message.h"
#include "cullet/preload/tree_users.h"

#include <atomic>

// Exported although the default visibility is hidden.
#pragma GCC visibility push(default)
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#pragma GCC visibility pop

namespace
{
using cullet::preload::BulletLibrary;
using cullet::preload::Function;
using cullet::preload::Implementation;

/// Virtual tables of the stand-ins, one per precision; null until one was created.
std::atomic<const void*> g_standInTables[2];

const void* tableOf(const void* object)
{
    return *static_cast<const void* const*>(object);
}

bool isStandIn(const void* object)
{
    const void* table = tableOf(object);
    return table == g_standInTables[0].load(std::memory_order_acquire) ||
           table == g_standInTables[1].load(std::memory_order_acquire);
}

void rememberTable(const void* table)
{
    const void* expected = nullptr;
    if (!g_standInTables[0].compare_exchange_strong(expected, table) && expected != table)
        g_standInTables[1].store(table);
}

/// The object, for calls of its virtual functions.
btBroadphaseInterface& standIn(void* object)
{
    return *static_cast<btBroadphaseInterface*>(static_cast<btDbvtBroadphase*>(object));
}

template <class Result, class... Arguments>
Result call(const BulletLibrary& bullet, Function function, Arguments... arguments)
{
    void* address = bullet.functions[static_cast<std::size_t>(function)];
    return reinterpret_cast<Result (*)(Arguments...)>(address)(arguments...);
}

template <class Result, class... Arguments>
Result callBullet(Function function, const void* caller, Arguments... arguments)
{
    return call<Result>(cullet::preload::knownLibraryFor(caller), function, arguments...);
}

bool construct(const BulletLibrary& bullet, const void* caller, void* memory, void* cache)
{
    if (bullet.implementation == nullptr ||
        !bullet.implementation->construct(memory, cache, cullet::preload::referencesTrees(caller)))
        return false;
    rememberTable(tableOf(memory));
    return true;
}

void warnDerivedOnce()
{
    static std::atomic<bool> hasWarned{false};
    if (!hasWarned.exchange(true))
        cullet::preload::printLine("a class derived from btDbvtBroadphase keeps Bullet's own broad phase");
}
}  // namespace

CULLET_EXPORT void culletConstruct(void* self, void* cache) asm(CULLET_CONSTRUCT);
CULLET_EXPORT void culletConstruct(void* self, void* cache)
{
    const void* caller = CULLET_CALLER;
    const BulletLibrary& bullet = cullet::preload::libraryFor(caller);
    if (!construct(bullet, caller, self, cache))
        call<void>(bullet, Function::Construct, self, cache);
}

CULLET_EXPORT void culletConstructBase(void* self, void* cache) asm(CULLET_CONSTRUCT_BASE);
CULLET_EXPORT void culletConstructBase(void* self, void* cache)
{
    const void* caller = CULLET_CALLER;
    const BulletLibrary& bullet = cullet::preload::libraryFor(caller);
    const Implementation* own = bullet.implementation;
    // The stand-in itself derives from btDbvtBroadphase.
    if (own != nullptr && cullet::preload::baseOf(caller) != cullet::preload::baseOf(own))
        warnDerivedOnce();
    call<void>(bullet, Function::ConstructBase, self, cache);
}

CULLET_EXPORT void culletDestroy(void* self) asm(CULLET_DESTROY);
CULLET_EXPORT void culletDestroy(void* self)
{
    if (isStandIn(self))
        standIn(self).~btBroadphaseInterface();
    else
        callBullet<void>(Function::Destroy, CULLET_CALLER, self);
}

CULLET_EXPORT void culletDestroyBase(void* self) asm(CULLET_DESTROY_BASE);
CULLET_EXPORT void culletDestroyBase(void* self)
{
    callBullet<void>(Function::DestroyBase, CULLET_CALLER, self);
}

CULLET_EXPORT void culletDelete(void* self) asm(CULLET_DELETE);
CULLET_EXPORT void culletDelete(void* self)
{
    if (isStandIn(self))
        delete &standIn(self);
    else
        callBullet<void>(Function::Delete, CULLET_CALLER, self);
}

CULLET_EXPORT void culletConstructDispatcher(void* self,
                                             void* configuration) asm(CULLET_CONSTRUCT_DISPATCHER);
CULLET_EXPORT void culletConstructDispatcher(void* self, void* configuration)
{
    const BulletLibrary& bullet = cullet::preload::libraryFor(CULLET_CALLER);
    call<void>(bullet, Function::ConstructDispatcher, self, configuration);
    if (bullet.implementation != nullptr)
        bullet.implementation->adopt(self);
}

CULLET_EXPORT void culletConstructBaseDispatcher(void* self,
                                                 void* configuration) asm(CULLET_CONSTRUCT_BASE_DISPATCHER);
CULLET_EXPORT void culletConstructBaseDispatcher(void* self, void* configuration)
{
    // A derived class registers its own algorithms later, in its constructor, which overrides these.
    const BulletLibrary& bullet = cullet::preload::libraryFor(CULLET_CALLER);
    call<void>(bullet, Function::ConstructBaseDispatcher, self, configuration);
    if (bullet.implementation != nullptr)
        bullet.implementation->adopt(self);
}

btBroadphaseProxy* btDbvtBroadphase::createProxy(const btVector3& aabbMin, const btVector3& aabbMax,
                                                 int shapeType, void* userPtr, int group, int mask,
                                                 btDispatcher* dispatcher)
{
    if (isStandIn(this))
        return standIn(this).createProxy(aabbMin, aabbMax, shapeType, userPtr, group, mask, dispatcher);
    return callBullet<btBroadphaseProxy*>(Function::CreateProxy, CULLET_CALLER, this, &aabbMin, &aabbMax,
                                          shapeType, userPtr, group, mask, dispatcher);
}

void btDbvtBroadphase::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    if (isStandIn(this))
        standIn(this).destroyProxy(proxy, dispatcher);
    else
        callBullet<void>(Function::DestroyProxy, CULLET_CALLER, this, proxy, dispatcher);
}

void btDbvtBroadphase::setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                               btDispatcher* dispatcher)
{
    if (isStandIn(this))
        standIn(this).setAabb(proxy, aabbMin, aabbMax, dispatcher);
    else
        callBullet<void>(Function::SetAabb, CULLET_CALLER, this, proxy, &aabbMin, &aabbMax, dispatcher);
}

void btDbvtBroadphase::setAabbForceUpdate(btBroadphaseProxy* proxy, const btVector3& aabbMin,
                                          const btVector3& aabbMax, btDispatcher* dispatcher)
{
    if (isStandIn(this))
        standIn(this).setAabb(proxy, aabbMin, aabbMax, dispatcher);
    else
        callBullet<void>(Function::SetAabbForceUpdate, CULLET_CALLER, this, proxy, &aabbMin, &aabbMax,
                         dispatcher);
}

void btDbvtBroadphase::getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const
{
    if (isStandIn(this))
        standIn(const_cast<btDbvtBroadphase*>(this)).getAabb(proxy, aabbMin, aabbMax);
    else
        callBullet<void>(Function::GetAabb, CULLET_CALLER, this, proxy, &aabbMin, &aabbMax);
}

void btDbvtBroadphase::rayTest(const btVector3& rayFrom, const btVector3& rayTo,
                               btBroadphaseRayCallback& rayCallback, const btVector3& aabbMin,
                               const btVector3& aabbMax)
{
    if (isStandIn(this))
        standIn(this).rayTest(rayFrom, rayTo, rayCallback, aabbMin, aabbMax);
    else
        callBullet<void>(Function::RayTest, CULLET_CALLER, this, &rayFrom, &rayTo, &rayCallback, &aabbMin,
                         &aabbMax);
}

void btDbvtBroadphase::aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                                btBroadphaseAabbCallback& callback)
{
    if (isStandIn(this))
        standIn(this).aabbTest(aabbMin, aabbMax, callback);
    else
        callBullet<void>(Function::AabbTest, CULLET_CALLER, this, &aabbMin, &aabbMax, &callback);
}

void btDbvtBroadphase::calculateOverlappingPairs(btDispatcher* dispatcher)
{
    if (isStandIn(this))
        standIn(this).calculateOverlappingPairs(dispatcher);
    else
        callBullet<void>(Function::CalculateOverlappingPairs, CULLET_CALLER, this, dispatcher);
}

void btDbvtBroadphase::collide(btDispatcher* dispatcher)
{
    if (isStandIn(this))
        standIn(this).calculateOverlappingPairs(dispatcher);
    else
        callBullet<void>(Function::Collide, CULLET_CALLER, this, dispatcher);
}

// A stand-in has no tree to optimise, and defers no removal beyond calculateOverlappingPairs().
void btDbvtBroadphase::optimize()
{
    if (!isStandIn(this))
        callBullet<void>(Function::Optimize, CULLET_CALLER, this);
}

void btDbvtBroadphase::performDeferredRemoval(btDispatcher* dispatcher)
{
    if (!isStandIn(this))
        callBullet<void>(Function::PerformDeferredRemoval, CULLET_CALLER, this, dispatcher);
}

btOverlappingPairCache* btDbvtBroadphase::getOverlappingPairCache()
{
    if (isStandIn(this))
        return standIn(this).getOverlappingPairCache();
    return callBullet<btOverlappingPairCache*>(Function::GetOverlappingPairCache, CULLET_CALLER, this);
}

const btOverlappingPairCache* btDbvtBroadphase::getOverlappingPairCache() const
{
    if (isStandIn(this))
        return standIn(const_cast<btDbvtBroadphase*>(this)).getOverlappingPairCache();
    return callBullet<const btOverlappingPairCache*>(Function::GetOverlappingPairCacheConst, CULLET_CALLER,
                                                     this);
}

void btDbvtBroadphase::getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const
{
    if (isStandIn(this))
        standIn(const_cast<btDbvtBroadphase*>(this)).getBroadphaseAabb(aabbMin, aabbMax);
    else
        callBullet<void>(Function::GetBroadphaseAabb, CULLET_CALLER, this, &aabbMin, &aabbMax);
}

void btDbvtBroadphase::printStats()
{
    if (isStandIn(this))
        standIn(this).printStats();
    else
        callBullet<void>(Function::PrintStats, CULLET_CALLER, this);
}

void btDbvtBroadphase::resetPool(btDispatcher* dispatcher)
{
    if (isStandIn(this))
        standIn(this).resetPool(dispatcher);
    else
        callBullet<void>(Function::ResetPool, CULLET_CALLER, this, dispatcher);
}

namespace
{
/// Runs after main() and all handlers that the program has registered with atexit().
__attribute__((destructor)) void summarise()
{
    for (const BulletLibrary* bullet = cullet::preload::knownLibraries(); bullet != nullptr;
         bullet = bullet->next)
    {
        if (bullet->implementation != nullptr)
            bullet->implementation->summarise();
    }
}
}  // namespace
