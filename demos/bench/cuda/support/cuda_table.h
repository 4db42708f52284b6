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
/// What rows of all the pairs of a frame's boxes answer.
inline constexpr const char* kFreshPairs = "all pairs";

/// A line of `bench cuda`; its columns are told at runCudaBench().
struct CudaRow
{
    std::string scene, variant;
    std::string question;  ///< rows of one scene that answer the same one have the same hash; empty: none
    std::uint64_t bodies = 0, pairs = 0, bytes = 0, hash = 0;
    double gpuMs = 0, endToEndMs = 0;  ///< medians
    double p90Ms = 0, maxMs = 0;       ///< of the same times
    std::uint64_t lateFrames = 0;      ///< of pairs: searched twice, since a bin was full or a list too short
    double behindMs = 0;               ///< of updates: what the device still does when they are done, mean
    double overBest = 0;               ///< of bench cuda --orders, where the search was not told how
    LeastBytes moved;
};

/// Sets a median of the row, p90 and the maximum.
void setTimes(CudaRow& row, double CudaRow::*median, const std::vector<double>& times);

/// The same with the mean, where frames differ by what they do.
void setMeans(CudaRow& row, double CudaRow::*mean, const std::vector<double>& times);

CudaRow rowFor(const FreshScene& scene, const std::string& variant, const std::string& question);

/// Collects rows, prints them, and compares their hashes.
class CudaTable
{
public:
    explicit CudaTable(ResultFile& file);
    /// Measures how fast the device copies, which rows from then on are compared with, and adds a row for each way.
    void addCopies();
    /// @throws ProgramError (kExitDisagreement) where the hash is not that of an earlier row
    void add(const CudaRow& row);

private:
    /// The time of a row of all pairs over that of the uniform scene; 0 where that is not known.
    double overUniform(const CudaRow& row);

    ResultFile& m_file;
    HashCheck m_hashes;
    CopySpeed m_copies;
    std::map<std::string, double> m_uniformMs;  ///< by bodies and variant
    std::string m_cuda;
};
}  // namespace cullet
