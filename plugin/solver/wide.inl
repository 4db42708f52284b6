// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// `Wide`: numbers of several lanes of a block, in one register of CULLET_SOLVER_REGISTER bytes. To be included by kernels;
// internal linkage, since each instruction set has its own.
#include "cullet/base/simd_vector.h"
#include "cullet/plugin/solver/solver_rows.h"

#include <cmath>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr int kLanes = CULLET_SOLVER_REGISTER / sizeof(btScalar);
constexpr int kParts = kBlock / kLanes;
static_assert(kLanes * kParts == kBlock);

using Wide = typename VectorOf<btScalar, kLanes>::Type;
using WideMask = MaskOf<Wide>;

/// A vector in each lane.
struct Wide3
{
    Wide x, y, z;
};

[[gnu::always_inline]] inline Wide fill(btScalar value)
{
    return Wide{} + value;
}

[[gnu::always_inline]] inline Wide load(const BlockOf& block, int part)
{
    Wide wide;
    std::memcpy(&wide, block.lane + part * kLanes, sizeof(wide));
    return wide;
}
[[gnu::always_inline]] inline void store(BlockOf& block, int part, Wide wide)
{
    std::memcpy(block.lane + part * kLanes, &wide, sizeof(wide));
}
[[gnu::always_inline]] inline Wide3 load(const BlockOfVectors& block, int part)
{
    return {load(block.x, part), load(block.y, part), load(block.z, part)};
}
[[gnu::always_inline]] inline void store(BlockOfVectors& block, int part, const Wide3& v)
{
    store(block.x, part, v.x);
    store(block.y, part, v.y);
    store(block.z, part, v.z);
}

[[gnu::always_inline]] inline WideMask inAllLanes(bool value)
{
    return value ? Wide{} == Wide{} : Wide{} != Wide{};
}

/// The second one where they are equal or one is NaN, as the processor's instruction does.
[[gnu::always_inline]] inline Wide larger(Wide a, Wide b)
{
    return a > b ? a : b;
}
[[gnu::always_inline]] inline Wide lesser(Wide a, Wide b)
{
    return a < b ? a : b;
}
[[gnu::always_inline]] inline Wide root(Wide a)
{
    // The kernels are compiled without errno, so that this is one instruction.
    btScalar lanes[kLanes];
    std::memcpy(lanes, &a, sizeof(a));
    for (btScalar& lane : lanes)
        lane = std::sqrt(lane);
    std::memcpy(&a, lanes, sizeof(a));
    return a;
}

[[gnu::always_inline]] inline Wide3 operator+(const Wide3& a, const Wide3& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[gnu::always_inline]] inline Wide3 operator-(const Wide3& a, const Wide3& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[gnu::always_inline]] inline Wide3 operator*(const Wide3& a, Wide b)
{
    return {a.x * b, a.y * b, a.z * b};
}
[[gnu::always_inline]] inline Wide3 scale(const Wide3& a, const Wide3& b)
{
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}
[[gnu::always_inline]] inline Wide dot(const Wide3& a, const Wide3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
[[gnu::always_inline]] inline Wide3 cross(const Wide3& a, const Wide3& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
[[gnu::always_inline]] inline Wide3 choose(WideMask mask, const Wide3& a, const Wide3& b)
{
    return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}

/// Four numbers of each lane's record.
struct WideQuad
{
    Wide a, b, c, d;
};

/// Reads and writes four numbers of a record of each lane.
///
/// @tparam W the vector; a parameter, since the shuffles exist for its number of lanes only
template <class W, int kCount>
struct Records;

template <class W>
struct Records<W, 2>
{
    [[gnu::always_inline]] static WideQuad read(const btScalar* const* from)
    {
        W low[2], high[2];
        for (int i = 0; i < 2; ++i)
        {
            std::memcpy(&low[i], from[i], sizeof(W));
            std::memcpy(&high[i], from[i] + 2, sizeof(W));
        }
        return {CULLET_SHUFFLE(low[0], low[1], 0, 2), CULLET_SHUFFLE(low[0], low[1], 1, 3),
                CULLET_SHUFFLE(high[0], high[1], 0, 2), CULLET_SHUFFLE(high[0], high[1], 1, 3)};
    }
    [[gnu::always_inline]] static void write(const WideQuad& quad, btScalar* const* to, unsigned lanes)
    {
        const W low[2] = {CULLET_SHUFFLE(quad.a, quad.b, 0, 2), CULLET_SHUFFLE(quad.a, quad.b, 1, 3)};
        const W high[2] = {CULLET_SHUFFLE(quad.c, quad.d, 0, 2), CULLET_SHUFFLE(quad.c, quad.d, 1, 3)};
        for (int i = 0; i < 2; ++i)
        {
            if ((lanes >> i & 1) == 0)
                continue;
            std::memcpy(to[i], &low[i], sizeof(W));
            std::memcpy(to[i] + 2, &high[i], sizeof(W));
        }
    }
};

template <class W>
struct Records<W, 4>
{
    [[gnu::always_inline]] static WideQuad read(const btScalar* const* from)
    {
        W rows[4];
        for (int i = 0; i < 4; ++i)
            std::memcpy(&rows[i], from[i], sizeof(W));
        return transpose(rows[0], rows[1], rows[2], rows[3]);
    }
    [[gnu::always_inline]] static void write(const WideQuad& quad, btScalar* const* to, unsigned lanes)
    {
        const WideQuad rows = transpose(quad.a, quad.b, quad.c, quad.d);
        const W* const row[4] = {&rows.a, &rows.b, &rows.c, &rows.d};
        for (int i = 0; i < 4; ++i)
        {
            if ((lanes >> i & 1) != 0)
                std::memcpy(to[i], row[i], sizeof(W));
        }
    }

private:
    [[gnu::always_inline]] static WideQuad transpose(const W& a, const W& b, const W& c, const W& d)
    {
        const W lowAb = CULLET_SHUFFLE(a, b, 0, 4, 1, 5), highAb = CULLET_SHUFFLE(a, b, 2, 6, 3, 7);
        const W lowCd = CULLET_SHUFFLE(c, d, 0, 4, 1, 5), highCd = CULLET_SHUFFLE(c, d, 2, 6, 3, 7);
        return {CULLET_SHUFFLE(lowAb, lowCd, 0, 1, 4, 5), CULLET_SHUFFLE(lowAb, lowCd, 2, 3, 6, 7),
                CULLET_SHUFFLE(highAb, highCd, 0, 1, 4, 5), CULLET_SHUFFLE(highAb, highCd, 2, 3, 6, 7)};
    }
};

/// The records of lanes i and i + 4 share a register, whose halves are transposed at once.
template <class W>
struct Records<W, 8>
{
    using Half = typename VectorOf<btScalar, 4>::Type;

    [[gnu::always_inline]] static WideQuad read(const btScalar* const* from)
    {
        W rows[4];
        for (int i = 0; i < 4; ++i)
        {
            Half low, high;
            std::memcpy(&low, from[i], sizeof(Half));
            std::memcpy(&high, from[i + 4], sizeof(Half));
            rows[i] = join(low, high);
        }
        return transpose(rows[0], rows[1], rows[2], rows[3]);
    }
    [[gnu::always_inline]] static void write(const WideQuad& quad, btScalar* const* to, unsigned lanes)
    {
        const WideQuad rows = transpose(quad.a, quad.b, quad.c, quad.d);
        const W* const row[4] = {&rows.a, &rows.b, &rows.c, &rows.d};
        for (int i = 0; i < 4; ++i)
        {
            if ((lanes >> i & 1) != 0)
                std::memcpy(to[i], row[i], sizeof(Half));
            if ((lanes >> (i + 4) & 1) != 0)
                std::memcpy(to[i + 4], reinterpret_cast<const char*>(row[i]) + sizeof(Half), sizeof(Half));
        }
    }

private:
    [[gnu::always_inline]] static W join(const Half& low, const Half& high)
    {
#if defined(__clang__) || __GNUC__ >= 12
        return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
#else
        W both;
        std::memcpy(&both, &low, sizeof(Half));
        std::memcpy(reinterpret_cast<char*>(&both) + sizeof(Half), &high, sizeof(Half));
        return both;
#endif
    }
    [[gnu::always_inline]] static WideQuad transpose(const W& a, const W& b, const W& c, const W& d)
    {
        const W lowAb = CULLET_SHUFFLE(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
        const W highAb = CULLET_SHUFFLE(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
        const W lowCd = CULLET_SHUFFLE(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
        const W highCd = CULLET_SHUFFLE(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
        return {CULLET_SHUFFLE(lowAb, lowCd, 0, 1, 8, 9, 4, 5, 12, 13),
                CULLET_SHUFFLE(lowAb, lowCd, 2, 3, 10, 11, 6, 7, 14, 15),
                CULLET_SHUFFLE(highAb, highCd, 0, 1, 8, 9, 4, 5, 12, 13),
                CULLET_SHUFFLE(highAb, highCd, 2, 3, 10, 11, 6, 7, 14, 15)};
    }
};
using WideRecords = Records<Wide, kLanes>;
}  // namespace
}  // namespace CULLET_PRECISION
}  // namespace cullet
