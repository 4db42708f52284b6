// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_floor.h"
#include "cullet/demos/program/files/hash_check.h"
#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/scenes/fresh_boxes.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cullet
{
/// The question of rows that find all pairs of a frame's boxes.
inline constexpr const char* kFreshPairs = "all pairs";

/// A line of `bench cuda`; runCudaBench() documents its columns.
struct CudaRow
{
    std::string scene, variant;
    std::string question;  ///< rows of one scene with the same question have the same hash; empty: none
    std::uint64_t bodies = 0, pairs = 0, bytes = 0, hash = 0;
    double gpuMs = 0, endToEndMs = 0;  ///< medians
    double p90Ms = 0, maxMs = 0;       ///< of the same times
    std::uint64_t lateFrames = 0;      ///< for pairs: searched twice, for lack of room
    double afterUpdateMs = 0;          ///< for updates: mean time that the device works after them
    double overBest = 0;               ///< for bench cuda --orders, for the automatic choice
    LeastBytes moved;
};

/// Sets a median of the row, p90 and the maximum.
void setTimes(CudaRow& row, double CudaRow::*median, const std::vector<double>& times);

/// Sets a mean of the row, p90 and the maximum, for frames that do different work.
void setMeans(CudaRow& row, double CudaRow::*mean, const std::vector<double>& times);

CudaRow rowFor(const FreshScene& scene, const std::string& variant, const std::string& question);

/// Collects rows, prints them, and compares their hashes.
class CudaTable
{
public:
    explicit CudaTable(ResultFile& file);
    /// Measures the copy speeds of the device, to which later rows are compared, and adds a row for each kind of copy.
    void addCopies();
    /// @throws ProgramError (kExitDisagreement) if the hash differs from that of an earlier row
    void add(const CudaRow& row);

private:
    /// The time of a row of all pairs over that of the uniform scene; 0 if that is unknown.
    double overUniform(const CudaRow& row);

    ResultFile& m_file;
    HashCheck m_hashes;
    CopySpeed m_copies;
    std::map<std::string, double> m_uniformMs;  ///< by bodies and variant
    std::string m_cuda;
};
}  // namespace cullet
