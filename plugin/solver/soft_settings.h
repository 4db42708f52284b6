// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <cstddef>
#include <cstdio>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Settings that have no effect on SolverModel::Soft.
class SoftSettings
{
public:
    /// Lists those that are not Bullet's default.
    explicit SoftSettings(const btContactSolverInfo& info)
    {
        const btContactSolverInfo standard;
        const auto add = [this](const char* name, bool isStandard)
        {
            const std::size_t used = std::strlen(m_names);
            if (!isStandard)
                std::snprintf(m_names + used, sizeof(m_names) - used, "%s%s", used > 0 ? ", " : "", name);
        };
        add("m_erp2", info.m_erp2 == standard.m_erp2);
        add("m_globalCfm of contacts", info.m_globalCfm == standard.m_globalCfm);
        add("m_sor", info.m_sor == standard.m_sor);
        add("m_splitImpulse", info.m_splitImpulse == standard.m_splitImpulse);
        add("m_splitImpulsePenetrationThreshold",
            info.m_splitImpulsePenetrationThreshold == standard.m_splitImpulsePenetrationThreshold);
        add("m_splitImpulseTurnErp", info.m_splitImpulseTurnErp == standard.m_splitImpulseTurnErp);
        add("m_warmstartingFactor", info.m_warmstartingFactor == standard.m_warmstartingFactor);
        add("m_leastSquaresResidualThreshold",
            info.m_leastSquaresResidualThreshold == standard.m_leastSquaresResidualThreshold);
    }

    /// With commas between them; empty: there are none.
    const char* names() const { return m_names; }

private:
    char m_names[256] = {};
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
