// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/heap_usage.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace cullet
{
std::uint64_t heapBytesInUse()
{
#if defined(__GLIBC__)
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
#else
    return 0;
#endif
}
}  // namespace cullet
