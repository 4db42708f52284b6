// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/cuda/narrow/hull_tables.h"

#include <cstdint>
#include <memory>

namespace cullet
{
template <class S>
class Hull;

/// Hulls in the form in which a device reads them, in the CPU's memory. Movable.
class CULLET_API HullSet
{
public:
    HullSet();
    HullSet(HullSet&&) noexcept;
    HullSet& operator=(HullSet&&) noexcept;
    ~HullSet();

    /// Adds a copy of a hull, which need not outlive the call: its corners, with their natural and artificial
    /// neighbours. Of any kind and with any number of points; pairs with a hull without points are invalid.
    ///
    /// @return its index, from 0 on
    /// Errors: std::bad_alloc, also from 2^32 blocks on, which are 512 GiB; the set is then unchanged
    /// Cost: O(n) time and, for each vertex and every seven of its neighbours, 128 bytes; up to 150 bytes more for each
    /// vertex, and 816 for the hull
    std::uint32_t add(const Hull<float>& hull);

    std::uint32_t size() const;
    std::uint64_t blockCount() const;

    /// Addresses in the CPU's memory. Void after add(), and after the end of this set.
    convex::HullTables tables() const;
    convex::SurfaceTables surfaces() const;
    convex::SurfaceSizes surfaceSizes() const;

private:
    struct Arrays;
    std::unique_ptr<Arrays> m_arrays;
};
}  // namespace cullet
