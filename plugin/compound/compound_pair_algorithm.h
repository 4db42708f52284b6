// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/compound/compound_algorithm.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The contacts of two compounds; replaces btCompoundCompoundCollisionAlgorithm, and does for pairs of their children what
/// CompoundAlgorithm does for children.
///
/// Two trees are walked in Bullet's order. The frame of one in the other is prepared once, and the algorithm of a pair of
/// children is most often the next one in the list of the last call. If a compound has no tree, each child of the first
/// has an algorithm with all of the second.
class CompoundPairAlgorithm final : public CompoundAlgorithm
{
public:
    CompoundPairAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                          const btCollisionObjectWrapper* b);
    ~CompoundPairAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;
    void getAllContactManifolds(btManifoldArray& manifolds) override;

private:
    class Pass;
    struct Pairs;

    void process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                 const btDispatcherInfo& info, btManifoldResult& result);
    void clearPairs();
    Pairs& pairs(const btCompoundShape& a, const btCompoundShape& b);
    void refreshFirst(Pairs& pairs, btManifoldResult& result);
    void destroyFarPairs(Pairs& pairs, const Pass& pass, btManifoldResult& result);

    std::unique_ptr<Pairs> m_pairs;  ///< null: none
};

static_assert(sizeof(CompoundPairAlgorithm) <= 192, "too large for the pool of Bullet's configuration");
}  // namespace CULLET_PRECISION
}  // namespace cullet
