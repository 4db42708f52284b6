// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/subject.h"
#include "cullet/demos/scenes/bodies/broadphase_factory.h"

#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
btVector3 toVector(const float* coordinates);

/// A broad phase behind Bullet's interface, without a world: proxies that store their row, and a null dispatcher, as no
/// pair has an algorithm.
class BulletSubject : public Subject
{
public:
    explicit BulletSubject(const SubjectRequest& request);
    ~BulletSubject() override;

    void create(const Aabb* boxes, std::size_t count) override;
    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override;
    void remove(std::uint32_t row) override;
    void findPairs() override;
    PairDigest digest(const std::vector<Aabb>& boxes) override;
    std::uint64_t heldPairs() override;
    int threads() const override { return m_broadphase.threads; }
    std::string path() const override;

    btBroadphaseInterface& broadphase() { return *m_broadphase.broadphase; }

    static std::uint32_t rowOf(const btBroadphaseProxy& proxy);

private:
    NamedBroadphase m_broadphase;
    std::vector<btBroadphaseProxy*> m_proxies;  ///< by row; null where removed
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
