// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <type_traits>
#include <utility>

/// The vector extension that GCC (9 and later) and Clang (11 and later) share: types, comparisons, `?:` and
/// __builtin_convertvector() as they are; what the two spell differently is here.
namespace cullet
{
/// kLanes numbers of one type, in one register or in as many as they need.
template <class T, int kLanes>
struct VectorOf
{
    typedef T Type __attribute__((vector_size(kLanes * sizeof(T))));
};

/// What a comparison of two such vectors gives: lanes of integers as wide, 0 or -1. Clang and GCC have different 64-bit
/// integers there.
template <class Vector>
using MaskOf = decltype(std::declval<Vector>() < std::declval<Vector>());

/// The type of one lane.
template <class Vector>
using LaneOf = std::decay_t<decltype(std::declval<Vector>()[0])>;
}  // namespace cullet

/// Lanes of two vectors (the second one's follow the first one's) in the order of constant indices. A macro, since how a
/// function passes vectors depends on the instruction set.
#if defined(__clang__) || __GNUC__ >= 12
#define CULLET_SHUFFLE(first, second, ...) __builtin_shufflevector(first, second, __VA_ARGS__)
#else
#define CULLET_SHUFFLE(first, second, ...) \
    __builtin_shuffle(first, second, ::cullet::MaskOf<std::decay_t<decltype(first)>>{__VA_ARGS__})
#endif
