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
/// Records the calls of another broad phase in a file, for `cullet replay` and `cullet verify`.
///
/// Sits between a Bullet world and any broad phase and forwards all calls and results, so that the world runs as it
/// does without it:
///
///     btDbvtBroadphase dbvt;                                       // or any other
///     cullet::RecordingBroadphase broadphase(dbvt, "scene.cbx");   // give this one to the world
///
/// The file contains boxes, filter words and the times of pair searches, but no ray and box queries. A filter word that
/// the application writes into a proxy is recorded in the next calculateOverlappingPairs(). The class is in the library
/// cullet::recording (cullet::recording-float64), which needs zlib.
///
/// Threads: as for the inner broad phase, but every call that changes something needs exclusive access.
/// Errors: the constructor throws std::bad_alloc, the other functions only what the inner broad phase throws. If the
/// file cannot be written, or there is no memory for the recording, the world runs on unrecorded; see error().
/// Cost: a hash look-up and 5 to 61 bytes, compressed, for each call; O(live proxies) for calculateOverlappingPairs().
class RecordingBroadphase final : public btBroadphaseInterface
{
public:
    /// @param inner the broad phase that does the work; must outlive this object, and have no proxies yet
    RecordingBroadphase(btBroadphaseInterface& inner, const std::string& path);

    /// Finishes the file if finish() was not called.
    ~RecordingBroadphase() override;
    RecordingBroadphase(const RecordingBroadphase&) = delete;
    RecordingBroadphase& operator=(const RecordingBroadphase&) = delete;

    /// Closes the file; later calls are not recorded. Call it before the world is destroyed, or the file also contains
    /// the destruction. Returns whether the recording is complete.
    bool finish();

    /// One line with the file and the reason; empty if there was no error.
    const std::string& error() const noexcept;

    /// Number of recorded calls of calculateOverlappingPairs().
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
