// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <limits>

namespace cullet
{
/// Entries that may be read behind the last row of a pool: a full vector of the widest kernel.
inline constexpr std::uint32_t kRowPadding = 16;

/// Bits of RowSoa::flags: the box begins in this cell along the first / second tiled axis.
enum RowFlag : std::uint8_t
{
    kStartsHereY = 1,
    kStartsHereZ = 2,
    kOwnsPair = kStartsHereY | kStartsHereZ
};

/// The boxes of one row (a cell of the two tiled axes), sorted by `x0`, as structure of arrays.
///
/// x is the sweep axis, y and z the tiled ones, whatever world axes these are. One sentinel with x0 = +infinity follows
/// the entries, so that scans need no end test; what lies behind it may be another row, at least kRowPadding readable
/// entries of anything.
struct RowSoa
{
    float* x0;
    float* x1;
    float* y0;
    float* y1;
    float* z0;
    float* z1;
    std::uint32_t* id;    ///< row of the proxy table
    std::uint8_t* flags;  ///< RowFlag bits
    std::uint32_t count;
};

/// Two rows of the proxy table, unordered, found to overlap.
struct IdPair
{
    std::uint32_t a;
    std::uint32_t b;
};

/// No gap is below this.
inline constexpr float kReportAll = std::numeric_limits<float>::quiet_NaN();

/// Where kernels put what they find: a fixed buffer that is handed on whenever it might overflow.
struct PairBuffer
{
    static constexpr std::uint32_t kCapacity = 1024;
    IdPair pairs[kCapacity];
    std::uint32_t count = 0;
    float deepGap = kReportAll;  ///< pairs whose gap (negative: overlap) is not above this are left out
    std::uint64_t tests = 0;     ///< box tests made, whole vectors
    void (*flush)(void* context, const IdPair* pairs, std::uint32_t count) = nullptr;
    void* context = nullptr;

    void handOn()
    {
        if (count != 0)
            flush(context, pairs, count);
        count = 0;
    }

    /// Makes room for one vector of hits.
    void ensureRoom()
    {
        if (count + kRowPadding > kCapacity)
            handOn();
    }
};

/// The inner loops, one set per instruction set; every set finds the same pairs.
///
/// Duplicates over cells are dropped by the owner rule: the cell that holds (max of the y minima, max of the z
/// minima) reports the pair. Inside a cell that is true exactly when, on both axes, one of the two begins in it.
struct RowKernels
{
    const char* name;

    /// Pairs inside one row. Forward sweep: for each entry, the entries behind it with x0 <= its x1.
    void (*scanSelf)(const RowSoa& row, PairBuffer& out);

    /// Pairs between two rows of the same cell.
    void (*scanCross)(const RowSoa& a, const RowSoa& b, PairBuffer& out);

    /// Entries of `row` from `begin` on that overlap entry `index` of `query`; ends at the first x0 beyond its x1.
    void (*scanOne)(const RowSoa& query, std::uint32_t index, const RowSoa& row, std::uint32_t begin,
                    PairBuffer& out);
};

extern const RowKernels kRowKernelsBaseline;
#if defined(__x86_64__)
extern const RowKernels kRowKernelsAvx2;
extern const RowKernels kRowKernelsAvx512;
#endif

/// The widest set that this processor runs; the baseline one if asked for.
const RowKernels& chooseRowKernels(bool baseline);
}  // namespace cullet
