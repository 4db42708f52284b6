// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <cstdint>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Where a function of Bullet's library begins, as pointers that the library itself hands out. Under Windows the address that a
/// program takes of a function in a DLL is that of a jump in the program, "jmp *[rip + offset]".
template <class Function>
Function* addressInLibrary(Function* function)
{
#if defined(_WIN32) && defined(__x86_64__)
    constexpr unsigned char kJump[] = {0xff, 0x25};
    const auto* code = reinterpret_cast<const unsigned char*>(function);
    if (std::memcmp(code, kJump, sizeof kJump) == 0)
    {
        std::int32_t offset = 0;
        std::memcpy(&offset, code + sizeof kJump, sizeof offset);
        std::memcpy(&function, code + sizeof kJump + sizeof offset + offset, sizeof function);
    }
#endif
    return function;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
