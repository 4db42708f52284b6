// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx2; entered only where the processor has it.
#if defined(__x86_64__)
#include "cullet/plugin/convex/box_kernels.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
void collideBoxesAvx2(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group,
                      BoxContact<btScalar>& contact)
{
    collideSources<FourLanes<btScalar, 32>>(a, b, group, contact);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
#endif  // x86-64
