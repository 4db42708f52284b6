// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cfenv>

namespace cullet
{
/// The floating-point mode of the thread that creates it: rounding, traps, and whether denormal numbers are zeros.
class FloatingPointMode
{
public:
    FloatingPointMode() noexcept { std::fegetenv(&m_mode); }

    /// Another thread computes in that mode while the scope lives, so that it gets the same bits.
    class Scope
    {
    public:
        /// @param isOther false: the thread is in that mode already
        Scope(const FloatingPointMode& mode, bool isOther) noexcept : m_isOther(isOther)
        {
            if (!isOther)
                return;
            std::fegetenv(&m_before);
            std::fesetenv(&mode.m_mode);
        }
        ~Scope()
        {
            if (m_isOther)
                std::fesetenv(&m_before);
        }
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        bool m_isOther;
        std::fenv_t m_before;
    };

private:
    std::fenv_t m_mode;
};
}  // namespace cullet
