// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/program/result_file.h"
#include "demos/scenes/fresh_boxes.h"

#include <cstdint>
#include <string>

namespace cullet
{
/// Of the boxes of the first frame; the next number for each set that follows.
inline constexpr std::uint64_t kFirstSeed = 12345;

/// A line of `bench cuda`; its columns are told at runCudaBench().
struct CudaRow
{
    std::string scene, variant;
    std::uint64_t bodies = 0, pairs = 0, bytes = 0, hash = 0;
    double gpuMs = 0, endToEndMs = 0;
};

CudaRow rowFor(const FreshScene& scene, const std::string& variant);

/// Collects rows, and prints them.
class CudaTable
{
public:
    explicit CudaTable(ResultFile& file);
    void add(const CudaRow& row);

private:
    ResultFile& m_file;
    std::string m_cuda;
};
}  // namespace cullet
