// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Body of the row kernels. Each including file defines, in an anonymous namespace, `struct Lanes` with:
//   Value, kWidth, load(const float*), broadcast(float), subtract, larger(Value, Value),
//   Mask, le(Value, Value), both(Mask, Mask), bits(Mask)
// Comparisons and single subtractions are all that is computed, so every width finds the same pairs.

namespace
{
/// Box of one entry, spread over all lanes.
struct Query
{
    Lanes::Value x0, x1, y0, y1, z0, z1;
};

inline Query makeQuery(const RowSoa& row, std::uint32_t i)
{
    return {Lanes::broadcast(row.x0[i]), Lanes::broadcast(row.x1[i]), Lanes::broadcast(row.y0[i]),
            Lanes::broadcast(row.y1[i]), Lanes::broadcast(row.z0[i]), Lanes::broadcast(row.z1[i])};
}

/// Lanes whose box overlaps the query's deeper than the buffer wants to know of.
inline std::uint32_t deepLanes(const Query& query, const RowSoa& row, std::uint32_t j, const PairBuffer& out)
{
    Lanes::Value gap = Lanes::larger(Lanes::subtract(Lanes::load(row.x0 + j), query.x1),
                                     Lanes::subtract(query.x0, Lanes::load(row.x1 + j)));
    gap = Lanes::larger(gap, Lanes::subtract(Lanes::load(row.y0 + j), query.y1));
    gap = Lanes::larger(gap, Lanes::subtract(query.y0, Lanes::load(row.y1 + j)));
    gap = Lanes::larger(gap, Lanes::subtract(Lanes::load(row.z0 + j), query.z1));
    gap = Lanes::larger(gap, Lanes::subtract(query.z0, Lanes::load(row.z1 + j)));
    return Lanes::bits(Lanes::le(gap, Lanes::broadcast(out.deepGap)));
}

inline void emitHits(std::uint32_t hits, std::uint32_t id, std::uint32_t flags, const RowSoa& row,
                     std::uint32_t j, PairBuffer& out)
{
    out.ensureRoom();
    while (hits != 0)
    {
        const std::uint32_t k = j + static_cast<std::uint32_t>(__builtin_ctz(hits));
        hits &= hits - 1;
        out.pairs[out.count] = {id, row.id[k]};
        // Unconditional store, conditional advance: duplicates over cells are about a quarter of all hits, which a
        // branch would mispredict.
        out.count += ((flags | row.flags[k]) == kOwnsPair) ? 1u : 0u;
    }
}

/// Tests the entries of `row` from `begin` on, while their x0 lies inside the query's interval.
///
/// With kCheckEnd the entries' own x1 is tested too; without it the caller knows that x0 of the query comes first.
template <bool kCheckEnd>
inline void sweep(const Query& query, std::uint32_t id, std::uint32_t flags, const RowSoa& row,
                  std::uint32_t begin, PairBuffer& out)
{
    for (std::uint32_t j = begin;; j += Lanes::kWidth)
    {
        const Lanes::Mask inside = Lanes::le(Lanes::load(row.x0 + j), query.x1);
        Lanes::Mask hit = Lanes::both(inside, Lanes::le(Lanes::load(row.y0 + j), query.y1));
        hit = Lanes::both(hit, Lanes::le(query.y0, Lanes::load(row.y1 + j)));
        hit = Lanes::both(hit, Lanes::le(Lanes::load(row.z0 + j), query.z1));
        hit = Lanes::both(hit, Lanes::le(query.z0, Lanes::load(row.z1 + j)));
        if (kCheckEnd)
            hit = Lanes::both(hit, Lanes::le(query.x0, Lanes::load(row.x1 + j)));
        const std::uint32_t insideBits = Lanes::bits(inside);
        // Only the lanes before the first one outside count: behind the sentinel another row may follow.
        const std::uint32_t hits = Lanes::bits(hit) & ((~insideBits & (insideBits + 1)) - 1);
        if (hits != 0)
            emitHits(hits & ~deepLanes(query, row, j, out), id, flags, row, j, out);
        if (insideBits != kLanesFull)
        {
            out.tests += j + Lanes::kWidth - begin;
            return;
        }
    }
}

void scanSelf(const RowSoa& row, PairBuffer& out)
{
    for (std::uint32_t i = 0; i + 1 < row.count; ++i)
        sweep<false>(makeQuery(row, i), row.id[i], row.flags[i], row, i + 1, out);
}

void scanCross(const RowSoa& a, const RowSoa& b, PairBuffer& out)
{
    std::uint32_t i = 0;
    std::uint32_t j = 0;
    // Merge by x0: whichever begins first sweeps over the other row's entries that begin inside it.
    while (i < a.count && j < b.count)
    {
        if (a.x0[i] <= b.x0[j])
        {
            sweep<false>(makeQuery(a, i), a.id[i], a.flags[i], b, j, out);
            ++i;
        }
        else
        {
            sweep<false>(makeQuery(b, j), b.id[j], b.flags[j], a, i, out);
            ++j;
        }
    }
}

void scanOne(const RowSoa& query, std::uint32_t index, const RowSoa& row, std::uint32_t begin,
             PairBuffer& out)
{
    sweep<true>(makeQuery(query, index), query.id[index], query.flags[index], row, begin, out);
}
}  // namespace
