// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/box_kernels.h"

#include "cullet/narrow/hull/linear_scan_avx2.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
void collideBoxesBaseline(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group,
                          BoxContact<btScalar>& contact)
{
    collideSources<FourLanes<btScalar>>(a, b, group, contact);
}

void collideBoxes(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group, BoxContact<btScalar>& contact)
{
#if defined(__x86_64__)
    if (kHasAvx2)
        return collideBoxesAvx2(a, b, group, contact);
#endif
    collideBoxesBaseline(a, b, group, contact);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
