// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/narrow/narrow_subject.h"
#include "cullet/demos/program/files/result_file.h"

#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Options of `cullet bench narrow`.
struct NarrowOptions
{
    std::vector<std::string> shapes = {"ico12",     "ico42", "ico162", "ico642", "box8",
                                       "gridbox98", "ell50", "ell200", "prism32"};
    std::vector<std::string> regimes = {"separated", "near", "crossing", "overlapping"};
    std::vector<std::string> queries = {"boolean"};
    std::vector<std::string> algorithms = {"cullet", "bullet"};
    std::vector<std::string> temperatures = {"warm", "cold"};
    std::vector<std::string> supports = {"automatic"};
    int repetitions = 9;
    unsigned seed = 12345;
    bool quiet = false;
};

std::vector<std::string> narrowShapeNames();
std::vector<std::string> narrowQueryNames();
std::vector<std::string> narrowSupportNames();

template <class List>
std::vector<std::string> namesOf(const List& list)
{
    std::vector<std::string> names;
    for (const auto& entry : list)
        names.emplace_back(entry.name);
    return names;
}

/// Measures every combination of the options, all algorithms of a case interleaved, and prints and adds one row each;
/// then geometric means over the regular shapes that were measured.
///
/// @pre all names are known
void runNarrowBench(const NarrowOptions& options, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
