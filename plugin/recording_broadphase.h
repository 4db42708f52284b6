// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

#include <cstdint>
#include <memory>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Writes everything that another broad phase is told into a file, for `cullet replay` and `cullet verify`.
///
/// Stands between a Bullet world and any broad phase, which it calls with the same arguments and whose answers it
/// returns, so that the world runs as it does without:
///
///     btDbvtBroadphase dbvt;                                       // or any other
///     cullet::RecordingBroadphase broadphase(dbvt, "scene.cbx");   // goes to the world in its place
///
/// Recorded are boxes, filter words and the moments at which pairs are searched, not ray and box queries. Filter words
/// that the application writes into a proxy are seen in the next calculateOverlappingPairs(). The library
/// cullet::recording (cullet::recording-float64) has this class; it needs zlib.
///
/// Threads: as the inner broad phase, but one thread at a time for everything that changes something.
/// Errors: no exception but std::bad_alloc; see error(). When the file cannot be written, the world goes on without it.
/// Cost: a hash look-up and 5 to 61 bytes, compressed, for each call; O(live proxies) for calculateOverlappingPairs().
class RecordingBroadphase final : public btBroadphaseInterface
{
public:
    /// @param inner does the work; must outlive this object, and be without proxies
    RecordingBroadphase(btBroadphaseInterface& inner, const std::string& path);

    /// Finishes the file if finish() was not called.
    ~RecordingBroadphase() override;
    RecordingBroadphase(const RecordingBroadphase&) = delete;
    RecordingBroadphase& operator=(const RecordingBroadphase&) = delete;

    /// Closes the file; what comes after is not recorded. Call it before the world is taken apart, or the file has that
    /// too. Returns whether the recording is complete.
    bool finish();

    /// One line with the file and the reason; empty while all is well.
    const std::string& error() const noexcept;

    /// Calls of calculateOverlappingPairs() recorded.
    std::uint64_t frames() const noexcept;

    btBroadphaseProxy* createProxy(const btVector3& aabbMin, const btVector3& aabbMax, int shapeType,
                                   void* userPtr, int collisionFilterGroup, int collisionFilterMask,
                                   btDispatcher* dispatcher) override;
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;
    void setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                 btDispatcher* dispatcher) override;
    void getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const override;
    void rayTest(const btVector3& rayFrom, const btVector3& rayTo, btBroadphaseRayCallback& rayCallback,
                 const btVector3& aabbMin = btVector3(0, 0, 0),
                 const btVector3& aabbMax = btVector3(0, 0, 0)) override;
    void aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                  btBroadphaseAabbCallback& callback) override;
    void calculateOverlappingPairs(btDispatcher* dispatcher) override;
    btOverlappingPairCache* getOverlappingPairCache() override;
    const btOverlappingPairCache* getOverlappingPairCache() const override;
    void getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const override;
    void resetPool(btDispatcher* dispatcher) override;
    void printStats() override;

private:
    struct Parts;
    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
