// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Boxes as six arrays by row, one after the other. A row without a valid box holds NaN, which overlaps nothing.
struct BoxArrays
{
    const float* limits;   ///< [6 * stride] min x, max x, min y, max y, min z, max z
    std::uint32_t stride;  ///< length of each array, a multiple of 64
    std::uint32_t rows;    ///< the others need not be tested
};

/// Tests of one box against many at once, in registers of 16, 8 or 4 floats. The result does not depend on the width.
struct OverlapKernels
{
    const char* name;
    std::uint32_t worthwhileRows;  ///< up to this many boxes, testing all pairs beats a grid (measured)

    /// Writes to bit i of `bits` whether the closed box of `row`, grown on every side, overlaps that of row i, itself
    /// included; for the words `firstWord` to stride / 64 - 1. Bits of rows that need no test may be 0.
    void (*findOverlaps)(const BoxArrays& boxes, std::uint32_t row, float growth, std::uint32_t firstWord,
                         std::uint64_t* bits);
};

extern const OverlapKernels kOverlapKernelsBaseline;
#if defined(__x86_64__)
extern const OverlapKernels kOverlapKernelsAvx2;
extern const OverlapKernels kOverlapKernelsAvx512;
#endif

/// The kernels with the widest registers that this processor has.
const OverlapKernels& chooseOverlapKernels(bool baseline);
}  // namespace cullet
