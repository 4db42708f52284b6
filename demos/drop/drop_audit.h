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
/// The data of a world at the end of a step that an audit needs.
struct WorldSnapshot
{
    std::vector<AuditedProxy> proxies;
    PairDigest pairs;  ///< pairs of the pair cache whose boxes overlap
};

WorldSnapshot snapshotOf(WorldScene& world);

/// Counts how often the pairs of a world are the exact ones.
void auditExact(const std::vector<WorldSnapshot>& snapshots, AuditCount& count);

/// Runs DBVT and cullet's broad phase on the boxes of one world, in parallel to that world.
class LockStepAuditor
{
public:
    /// @param options must outlive this object
    LockStepAuditor(const DropOptions& options, WorldScene& world);

    void audit(const std::vector<WorldSnapshot>& snapshots, AuditCount& count);

    /// Sets the bytes of every contender's broad phase. The auditor is unusable afterwards.
    void measureMemory(std::vector<ContenderResult>& contenders);

private:
    void makeShadows(const std::vector<AuditedProxy>& proxies);

    const DropOptions& m_options;
    std::optional<ShadowBroadphase> m_cullet;
    std::optional<ShadowBroadphase> m_dbvt;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
