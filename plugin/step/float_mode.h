// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#if defined(__SSE2__)
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How the calling thread rounds, and whether it flushes tiny numbers to zero. Threads of a pool do neither as the
/// application set it for its own thread.
class FloatMode
{
#if defined(__SSE2__)
    using Mode = unsigned;
    static void read(Mode& mode)
    {
        mode = _mm_getcsr();
    }
    static void write(const Mode& mode)
    {
        _mm_setcsr(mode);
    }
    static void writeKeepingExceptions(const Mode& mode)
    {
        constexpr unsigned kExceptions = _MM_EXCEPT_MASK;
        _mm_setcsr((mode & ~kExceptions) | (_mm_getcsr() & kExceptions));
    }
#else
    using Mode = std::fenv_t;
    static void read(Mode& mode)
    {
        std::fegetenv(&mode);
    }
    static void write(const Mode& mode)
    {
        std::fesetenv(&mode);
    }
    static void writeKeepingExceptions(const Mode& mode)
    {
        std::feupdateenv(&mode);
    }
#endif

public:
    FloatMode()
    {
        read(m_mode);
    }

    /// Gives the calling thread another thread's mode while it lives.
    class Scope
    {
    public:
        explicit Scope(const FloatMode& mode)
        {
            read(m_before);
            write(mode.m_mode);
        }
        ~Scope() { writeKeepingExceptions(m_before); }
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        Mode m_before{};
    };

private:
    Mode m_mode{};
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
