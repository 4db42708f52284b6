// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

// Included by the headers whose classes hold standard containers. Such a class has another layout with _GLIBCXX_DEBUG,
// under the same name: the linker would take a function of it from the program or from a static library of cullet,
// whichever comes first. CULLET_DEBUG_CONTAINERS declares that this cannot happen: either cullet is compiled with
// _GLIBCXX_DEBUG too, or none of its static libraries is linked.
#if defined(_GLIBCXX_DEBUG) && !defined(CULLET_DEBUG_CONTAINERS)
#error "narrow/ needs the mode of containers that cullet was compiled in; see narrow/math/debug_containers.h"
#endif
