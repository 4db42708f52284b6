// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Boxes as six parallel arrays, one behind the other. A column without a valid box holds NaN, which overlaps nothing.
struct FlatBoxes
{
    const float* limits;   ///< [6 * stride] min x, max x, min y, max y, min z, max z
    std::uint32_t stride;  ///< columns, a multiple of 64
};

/// Tests one box against many at once, in registers of 16, 8 or 4 floats. The bits do not depend on the width.
struct OverlapKernels
{
    const char* name;
    std::uint32_t worthwhileRows;  ///< up to so many boxes, testing all against all beats a grid (measured)

    /// Bit c of `bits`: whether the closed box of `row`, grown on every side, and that of column c overlap, itself
    /// included; for the columns of the words `firstWord` to stride / 64 - 1.
    void (*findOverlaps)(const FlatBoxes& boxes, std::uint32_t row, float growth, std::uint32_t firstWord,
                         std::uint64_t* bits);
};

extern const OverlapKernels kFlatKernelsBaseline;
#if defined(__x86_64__)
extern const OverlapKernels kFlatKernelsAvx2;
extern const OverlapKernels kFlatKernelsAvx512;
#endif

/// The widest that this processor has.
const OverlapKernels& chooseFlatKernels(bool baseline);
}  // namespace cullet
