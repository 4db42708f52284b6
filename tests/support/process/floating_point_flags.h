// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cfenv>
#include <string>

/// The floating-point exceptions that end a program with feenableexcept().
namespace cullet::test
{
/// The flags that code raises on this thread; equivalent to traps, without ending the test.
template <class F>
int flagsOf(const F& code)
{
    std::feclearexcept(FE_ALL_EXCEPT);
    // The compiler must not move arithmetic across these two barriers.
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
