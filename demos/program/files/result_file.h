// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cullet
{
/// JSON that keeps the insertion order of keys.
using Json = nlohmann::ordered_json;

/// Results of one run of the program: `machine`, `commit`, `options` and `rows`, as JSON and as CSV.
///
/// Every row starts with the columns benchmark, scene, backend, precision, threads, bodies, pairs, median_ms, p90_ms,
/// min_ms, hash; more may follow. The CSV file has the union of all columns, and in each row cpu, gpu, commit and the
/// machine's description.
class ResultFile
{
public:
    /// @param options  the options that reproduce the run
    /// @param jsonPath output file; empty: none. csvPath likewise.
    /// @throws ProgramError (kExitOutput) at once if a path cannot be opened, before hours of work
    ResultFile(Json options, std::string jsonPath, std::string csvPath);

    void addRow(Json row) { m_rows.push_back(std::move(row)); }
    const std::vector<Json>& rows() const noexcept { return m_rows; }

    /// Writes both files. Throws ProgramError (kExitOutput).
    void save() const;

private:
    std::string toCsv() const;

    Json m_options;
    std::string m_jsonPath;
    std::string m_csvPath;
    std::vector<Json> m_rows;
};

/// Throws ProgramError (kExitOutput) when a file cannot be opened for writing; an empty path is fine.
void requireWritable(const std::string& path);

/// The hash in the form of result files: 16 hexadecimal digits.
std::string toHex(std::uint64_t hash);
}  // namespace cullet
