// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#if defined(__SSE2__)
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace cullet
{
/// How the thread that creates it rounds, whether it flushes tiny numbers to zero, and what it traps.
class FloatMode
{
#if defined(__SSE2__)
    using Mode = unsigned;
    static void read(Mode& mode)
    {
        mode = _mm_getcsr();
    }
    /// What the thread has raised stays raised.
    static void write(const Mode& mode)
    {
        constexpr unsigned kRaised = _MM_EXCEPT_MASK;
        _mm_setcsr((mode & ~kRaised) | (_mm_getcsr() & kRaised));
    }
    static void restore(const Mode& mode)
    {
        write(mode);
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
    static void restore(const Mode& mode)
    {
        std::feupdateenv(&mode);
    }
#endif

public:
    FloatMode()
    {
        read(m_mode);
    }

    /// Gives the calling thread another thread's mode while it lives. What the thread raises meanwhile stays raised.
    class Scope
    {
    public:
        explicit Scope(const FloatMode& mode)
        {
            read(m_before);
            write(mode.m_mode);
        }
        ~Scope() { restore(m_before); }
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        Mode m_before{};
    };

private:
    Mode m_mode{};
};
}  // namespace cullet
