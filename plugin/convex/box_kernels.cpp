// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/box_kernels.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
void collideBoxesBaseline(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group,
                          BoxContact<btScalar>& contact)
{
    collideSources<FourLanes<btScalar>>(a, b, group, contact);
}

CollideBoxes chooseCollideBoxes()
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") != 0)
        return collideBoxesAvx2;
#endif
    return collideBoxesBaseline;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
