// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/files/result_file.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/machine.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

namespace cullet
{
namespace
{
void writeText(const std::string& path, const std::string& text)
{
    if (path.empty())
        return;
    std::ofstream file(path, std::ios::trunc);
    file << text;
    file.close();
    if (!file)
        throw ProgramError(kExitOutput, "result file '" + path + "': cannot be written");
}

/// A CSV field by RFC 4180.
std::string toField(const Json& value)
{
    std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (text.find_first_of(",\"\n") == std::string::npos)
        return text;
    std::string quoted = "\"";
    for (const char c : text)
    {
        if (c == '"')
            quoted += '"';
        quoted += c;
    }
    return quoted + "\"";
}

Json toJson(const Machine& machine)
{
    return {{"cpu", machine.cpu},           {"instructions", machine.instructions},
            {"cores", machine.cores},       {"memory_gib", machine.memoryGib},
            {"gpu", machine.gpu},           {"system", machine.system},
            {"compiler", machine.compiler}, {"build_type", machine.buildType}};
}
}  // namespace

std::string toHex(std::uint64_t hash)
{
    char text[20];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash));
    return text;
}

void requireWritable(const std::string& path)
{
    if (path.empty())
        return;
    if (!std::ofstream(path, std::ios::app))
        throw ProgramError(kExitOutput, "result file '" + path + "': cannot be opened for writing");
}

ResultFile::ResultFile(Json options, std::string jsonPath, std::string csvPath)
    : m_options(std::move(options)), m_jsonPath(std::move(jsonPath)), m_csvPath(std::move(csvPath))
{
    requireWritable(m_jsonPath);
    requireWritable(m_csvPath);
}

void ResultFile::save() const
{
    const Json document = {{"machine", toJson(describeMachine())},
                           {"commit", builtCommit()},
                           {"options", m_options},
                           {"rows", m_rows}};
    writeText(m_jsonPath, document.dump(1) + "\n");
    writeText(m_csvPath, toCsv());
}

std::string ResultFile::toCsv() const
{
    const Machine machine = describeMachine();
    const Json common = {
        {"cpu", machine.cpu}, {"gpu", machine.gpu}, {"commit", builtCommit()}, {"machine", toLine(machine)}};
    std::vector<Json> rows = m_rows;
    std::vector<std::string> columns;
    for (Json& row : rows)
    {
        row.update(common);
        for (const auto& [key, value] : row.items())
        {
            if (common.contains(key))
                continue;
            if (std::find(columns.begin(), columns.end(), key) == columns.end())
                columns.push_back(key);
        }
    }
    for (const auto& [key, value] : common.items())
        columns.push_back(key);
    std::string text;
    for (std::size_t i = 0; i < columns.size(); ++i)
        text += (i == 0 ? "" : ",") + columns[i];
    text += '\n';
    for (const Json& row : rows)
    {
        for (std::size_t i = 0; i < columns.size(); ++i)
            text +=
                (i == 0 ? "" : ",") + (row.contains(columns[i]) ? toField(row[columns[i]]) : std::string());
        text += '\n';
    }
    return text;
}
}  // namespace cullet
