// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/solver/solver_scene.h"

namespace cullet::test
{
int ordersOf(int /*few*/)
{
    return 10;
}
}  // namespace cullet::test
