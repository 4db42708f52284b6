// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/simd_vector.h"
#include "cullet/base/vector16.h"

#include <cstring>
#include <limits>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace cullet
{
/// Four numbers in one or two vectors, as wide as the registers of the processor. For doubles, compilers turn Quad's
/// comparisons and shuffles into single lanes where registers have 16 bytes; and an object may be passed by value.
///
/// @tparam kRegister bytes: 16, or 32 in sources that are compiled for AVX2; their code has symbols of its own that way
template <class S, int kRegister = 16>
class FourLanes
{
public:
    using Scalar = S;
    static constexpr int kParts = sizeof(S) == 8 && kRegister == 16 ? 2 : 1;
    static constexpr int kWidth = 4 / kParts;
    using Vector = typename VectorOf<S, kWidth>::Type;

    FourLanes() = default;
    [[gnu::always_inline]] explicit FourLanes(S value)
    {
        for (Vector& part : m_parts)
            part = fill(value);
    }
    [[gnu::always_inline]] FourLanes(S x, S y, S z, S w)
    {
        if constexpr (kParts == 1)
            m_parts[0] = Vector{x, y, z, w};
        else
        {
            m_parts[0] = Vector{x, y};
            m_parts[1] = Vector{z, w};
        }
    }
    [[gnu::always_inline]] static FourLanes load(const S* p)
    {
        FourLanes v;
        std::memcpy(v.m_parts, p, sizeof(v.m_parts));
        return v;
    }
    [[gnu::always_inline]] void store(S* p) const { std::memcpy(p, m_parts, sizeof(m_parts)); }

    [[gnu::always_inline]] S operator[](int lane) const { return m_parts[lane / kWidth][lane % kWidth]; }

    /// The sequence of lanes of two objects; the second one's have the indices 4 to 7.
    template <int i, int j, int k, int l>
    [[gnu::always_inline]] static FourLanes shuffle(const FourLanes& a, const FourLanes& b)
    {
        FourLanes v;
        if constexpr (kParts == 1)
            v.m_parts[0] = CULLET_SHUFFLE(a.m_parts[0], b.m_parts[0], i, j, k, l);
        else
        {
            v.m_parts[0] = two<i, j>(a, b);
            v.m_parts[1] = two<k, l>(a, b);
        }
        return v;
    }
    /// The lanes of this object in another sequence.
    template <int i, int j, int k, int l>
    [[gnu::always_inline]] FourLanes lanes() const
    {
        return shuffle<i, j, k, l>(*this, *this);
    }
    /// One lane in all.
    template <int i>
    [[gnu::always_inline]] FourLanes spread() const
    {
        return lanes<i, i, i, i>();
    }

    /// @name Operators, lane by lane
    /// Comparisons give lanes of all bits or none.
    ///@{
    [[gnu::always_inline]] friend FourLanes operator+(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b, [](const Vector& x, const Vector& y, Vector& out) { out = x + y; });
    }
    [[gnu::always_inline]] friend FourLanes operator-(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b, [](const Vector& x, const Vector& y, Vector& out) { out = x - y; });
    }
    [[gnu::always_inline]] friend FourLanes operator*(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b, [](const Vector& x, const Vector& y, Vector& out) { out = x * y; });
    }
    [[gnu::always_inline]] friend FourLanes operator/(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b, [](const Vector& x, const Vector& y, Vector& out) { out = x / y; });
    }
    [[gnu::always_inline]] friend FourLanes operator*(const FourLanes& a, S b) { return a * FourLanes(b); }
    [[gnu::always_inline]] friend FourLanes operator+(const FourLanes& a, S b) { return a + FourLanes(b); }
    [[gnu::always_inline]] friend FourLanes operator-(const FourLanes& a, S b) { return a - FourLanes(b); }
    [[gnu::always_inline]] friend FourLanes operator<=(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b,
                    [](const Vector& x, const Vector& y, Vector& out)
                    { out = reinterpret_cast<Vector>(x <= y); });
    }
    [[gnu::always_inline]] friend FourLanes operator>(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b,
                    [](const Vector& x, const Vector& y, Vector& out)
                    { out = reinterpret_cast<Vector>(x > y); });
    }
    [[gnu::always_inline]] friend FourLanes operator==(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b,
                    [](const Vector& x, const Vector& y, Vector& out)
                    { out = reinterpret_cast<Vector>(x == y); });
    }
    /// Bit by bit.
    [[gnu::always_inline]] friend FourLanes operator&(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b,
                    [](const Vector& x, const Vector& y, Vector& out) {
                        out = reinterpret_cast<Vector>(reinterpret_cast<Mask>(x) & reinterpret_cast<Mask>(y));
                    });
    }
    [[gnu::always_inline]] friend FourLanes operator|(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b,
                    [](const Vector& x, const Vector& y, Vector& out) {
                        out = reinterpret_cast<Vector>(reinterpret_cast<Mask>(x) | reinterpret_cast<Mask>(y));
                    });
    }
    ///@}

    [[gnu::always_inline]] FourLanes magnitude() const
    {
        FourLanes v;
        for (int i = 0; i < kParts; ++i)
            v.m_parts[i] = reinterpret_cast<Vector>(reinterpret_cast<Mask>(m_parts[i]) &
                                                    (Mask{} + std::numeric_limits<LaneOf<Mask>>::max()));
        return v;
    }
    /// The larger number in each lane; of b if one is NaN.
    [[gnu::always_inline]] static FourLanes larger(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b, [](const Vector& x, const Vector& y, Vector& out) { takeLarger(x, y, out); });
    }
    /// The smaller number in each lane; of b if one is NaN.
    [[gnu::always_inline]] static FourLanes smaller(const FourLanes& a, const FourLanes& b)
    {
        return each(a, b, [](const Vector& x, const Vector& y, Vector& out) { takeSmaller(x, y, out); });
    }
    /// Root of a number that is not negative, without the call by which std::sqrt() sets errno.
    [[gnu::always_inline]] static S root(S x) { return squareRoot(x); }
    [[gnu::always_inline]] S largest() const
    {
        const FourLanes halves = larger(*this, lanes<2, 3, 0, 1>());
        return larger(halves, halves.template lanes<1, 0, 3, 2>())[0];
    }
    /// Lanes of `a` where those of a comparison are set, else of `b`.
    [[gnu::always_inline]] static FourLanes select(const FourLanes& isSet, const FourLanes& a,
                                                   const FourLanes& b)
    {
        FourLanes v;
        for (int i = 0; i < kParts; ++i)
        {
            const Mask mask = reinterpret_cast<Mask>(isSet.m_parts[i]);
            v.m_parts[i] = reinterpret_cast<Vector>((reinterpret_cast<Mask>(a.m_parts[i]) & mask) |
                                                    (reinterpret_cast<Mask>(b.m_parts[i]) & ~mask));
        }
        return v;
    }
    /// Bit i: lane i is set, in the result of a comparison.
    [[gnu::always_inline]] unsigned bits() const
    {
        unsigned all = 0;
        for (int i = 0; i < kParts; ++i)
            all |= signs(m_parts[i]) << (i * kWidth);
        return all;
    }

private:
    using Mask = MaskOf<Vector>;

    [[gnu::always_inline]] static Vector fill(S value)
    {
        if constexpr (kWidth == 4)
            return Vector{value, value, value, value};
        else
            return Vector{value, value};
    }

    template <int i, int j>
    [[gnu::always_inline]] static Vector two(const FourLanes& a, const FourLanes& b)
    {
        const Vector& first = (i < 4 ? a : b).m_parts[i / 2 % 2];
        const Vector& second = (j < 4 ? a : b).m_parts[j / 2 % 2];
        return CULLET_SHUFFLE(first, second, i % 2, 2 + j % 2);
    }

    template <class Operation>
    [[gnu::always_inline]] static FourLanes each(const FourLanes& a, const FourLanes& b,
                                                 const Operation& operation)
    {
        FourLanes v;
        for (int i = 0; i < kParts; ++i)
            operation(a.m_parts[i], b.m_parts[i], v.m_parts[i]);
        return v;
    }

    [[gnu::always_inline]] static unsigned signs(const Vector& mask)
    {
        if constexpr (sizeof(Vector) == 16)
            return laneBits(reinterpret_cast<const Mask&>(mask));
#ifdef __AVX__
        else
            return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<const __m256d&>(mask)));
#endif
    }

    [[gnu::always_inline]] static void takeLarger(const Vector& x, const Vector& y, Vector& out)
    {
        if constexpr (sizeof(Vector) == 16)
            out = largerOf(x, y);
        else
            out = x > y ? x : y;
    }
    [[gnu::always_inline]] static void takeSmaller(const Vector& x, const Vector& y, Vector& out)
    {
        if constexpr (sizeof(Vector) == 16)
            out = smallerOf(x, y);
        else
            out = x < y ? x : y;
    }

    Vector m_parts[kParts];
};
}  // namespace cullet
