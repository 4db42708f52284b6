// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>
#include <iterator>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The name of a setting that is not Bullet's default and has no effect on SolverModel::Soft; null: there is none.
inline const char* settingWithoutEffectOnSoft(const btContactSolverInfo& info)
{
    const btContactSolverInfo standard;
    struct Setting
    {
        const char* name;
        bool isStandard;
    };
    const Setting settings[] = {
        {"m_erp2", info.m_erp2 == standard.m_erp2},
        {"m_globalCfm of contacts", info.m_globalCfm == standard.m_globalCfm},
        {"m_sor", info.m_sor == standard.m_sor},
        {"m_splitImpulse", info.m_splitImpulse == standard.m_splitImpulse},
        {"m_splitImpulsePenetrationThreshold",
         info.m_splitImpulsePenetrationThreshold == standard.m_splitImpulsePenetrationThreshold},
        {"m_splitImpulseTurnErp", info.m_splitImpulseTurnErp == standard.m_splitImpulseTurnErp},
        {"m_warmstartingFactor", info.m_warmstartingFactor == standard.m_warmstartingFactor},
        {"m_leastSquaresResidualThreshold",
         info.m_leastSquaresResidualThreshold == standard.m_leastSquaresResidualThreshold},
    };
    const Setting* const found = std::find_if(std::begin(settings), std::end(settings),
                                              [](const Setting& setting) { return !setting.isStandard; });
    return found != std::end(settings) ? found->name : nullptr;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
