// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cfenv>
#include <string>

/// The floating-point exceptions that end a program with feenableexcept().
namespace cullet::test
{
/// Those that code raises on this thread: the flags say the same as traps would, and do not end the test.
template <class F>
int flagsOf(const F& code)
{
    std::feclearexcept(FE_ALL_EXCEPT);
    // The compiler may not move arithmetic over these two.
    asm volatile("" ::: "memory");
    code();
    asm volatile("" ::: "memory");
    return std::fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
}

inline std::string nameFlags(int flags)
{
    std::string names;
    names += (flags & FE_INVALID) != 0 ? " invalid" : "";
    names += (flags & FE_DIVBYZERO) != 0 ? " divide-by-zero" : "";
    names += (flags & FE_OVERFLOW) != 0 ? " overflow" : "";
    return names;
}
}  // namespace cullet::test
