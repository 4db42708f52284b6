// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/plugin/core/unique_id_map.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::abi
{
/// Lower or upper corners of a caller's boxes: three floats or doubles each, at any distances in bytes.
struct CornerArray
{
    const unsigned char* first;
    std::ptrdiff_t rowStride;   ///< from a box to the next
    std::ptrdiff_t axisStride;  ///< from a coordinate to the next
    bool isDouble;

    double at(std::size_t index, int axis) const;
};

/// Boxes of a caller, read where they are. Doubles are rounded outward.
class BoxArray
{
public:
    /// @param first  six floats, the first of `stride` bytes
    BoxArray(const float* first, std::size_t stride) : m_packed(first), m_stride(stride) {}
    BoxArray(const CornerArray& min, const CornerArray& max) : m_min(min), m_max(max) {}

    Aabb at(std::size_t index) const;

private:
    const float* m_packed = nullptr;  ///< null: corners
    std::size_t m_stride = 0;
    CornerArray m_min = {};
    CornerArray m_max = {};
};

/// A table of boxes with ids, a backend, and the pairs it found. A failing function throws and leaves boxes and pairs
/// unchanged.
class BoxSet
{
public:
    /// @param firstId id of the first box; others follow it
    BoxSet(std::unique_ptr<Backend> backend, int threads, float margin, std::uint32_t firstId = 1);

    /// @return false if some boxes are empty and overlap nothing
    bool add(const BoxArray& boxes, std::uint32_t count, std::uint32_t* ids);
    bool move(const std::uint32_t* ids, const BoxArray& boxes, std::uint32_t count);
    void setFilters(const std::uint32_t* ids, const cullet_filter* filters, std::uint32_t count);
    void remove(const std::uint32_t* ids, std::uint32_t count);

    void update();
    const PairDelta& delta() const { return m_delta; }
    const Pairs& pairs() const { return m_pairs; }

    void fill(cullet_box_set_stats& stats) const;

private:
    void requireIds(const std::uint32_t* ids, std::uint32_t count) const;
    Status tryUpdate();
    void runBackend();
    void reserveForDelta();
    void applyDelta() noexcept;

    static constexpr std::uint32_t kMostBoxes = 1u << 30;

    ProxyTable m_table;
    UniqueIdMap m_directory;
    std::unique_ptr<Backend> m_backend;
    int m_threads;
    float m_margin;
    std::uint32_t m_nextId;
    std::uint64_t m_fallbacks = 0;
    PairDelta m_delta;
    Pairs m_pairs;
    Pairs m_merged;  ///< memory that applyDelta() reuses
    bool m_needsRestart = false;
};
}  // namespace cullet::abi
