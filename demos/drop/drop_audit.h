// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/drop/drop_run.h"
#include "cullet/demos/drop/pair_audit.h"

#include <optional>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What an audit needs of a world at the end of a step.
struct WorldSnapshot
{
    std::vector<AuditedProxy> proxies;
    PairDigest pairs;  ///< those of the pair cache whose boxes overlap
};

WorldSnapshot snapshotOf(WorldScene& world);

/// Counts for a world how often its pairs are the exact ones.
void auditExact(const std::vector<WorldSnapshot>& snapshots, AuditCount& count);

/// Gives the boxes of one world to DBVT and to cullet's broad phase, beside that world.
class LockStepAuditor
{
public:
    /// @param options have to live longer
    LockStepAuditor(const DropOptions& options, WorldScene& world);

    void audit(const std::vector<WorldSnapshot>& snapshots, AuditCount& count);

    /// Sets the bytes of every contender's broad phase. Nothing can be audited afterwards.
    void measureMemory(std::vector<ContenderResult>& contenders);

private:
    void makeShadows(const std::vector<AuditedProxy>& proxies);

    const DropOptions& m_options;
    std::optional<ShadowBroadphase> m_cullet;
    std::optional<ShadowBroadphase> m_dbvt;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
