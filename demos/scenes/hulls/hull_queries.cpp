// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_queries.h"

namespace cullet
{
CULLET_ALL_HULL_QUERIES()
}  // namespace cullet
