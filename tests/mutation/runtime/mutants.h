// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <type_traits>

/// What the mutated sources call, included before everything else in each of them (tests/mutation/run).

extern "C"
{
    /// By mutant: 0 leaves the source as it is, anything else asks culletAskMutant().
    __attribute__((visibility("default"))) extern unsigned char culletMutantStates[];
    /// Whether the mutant is on. Else records that it was reached, and answers for it from then on.
    __attribute__((visibility("default"))) bool culletAskMutant(int mutant) noexcept;
}

// Inlined always: as a weak symbol, the one compiled for AVX-512 might run everywhere.
#define CULLET_MUTANT_INLINE __attribute__((always_inline)) inline

CULLET_MUTANT_INLINE bool cullet_mutant(int mutant) noexcept
{
    return __builtin_expect(__atomic_load_n(&culletMutantStates[mutant], __ATOMIC_RELAXED), 0) &&
           culletAskMutant(mutant);
}

template <class T>
using CulletNumber = std::enable_if_t<std::is_arithmetic<T>::value, T>;

/// Other values of a constant's type.
template <class T>
CULLET_MUTANT_INLINE CulletNumber<T> cullet_next(T value)
{
    return static_cast<T>(value + 1);
}
template <class T>
CULLET_MUTANT_INLINE CulletNumber<T> cullet_twice(T value)
{
    return static_cast<T>(value + value);
}
template <class T>
CULLET_MUTANT_INLINE CulletNumber<T> cullet_half(T value)
{
    return static_cast<T>(value / 2);
}

/// A mutex that no other thread locks.
template <class Mutex>
Mutex& cullet_unshared(const Mutex&)
{
    static thread_local Mutex mutex;
    return mutex;
}
