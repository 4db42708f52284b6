// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/files/trace_file.h"

#include "cullet/demos/program/exit_code.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace cullet
{
TraceFile::TraceFile(const std::string& path)
    : m_path(path), m_file(path, std::ios::trunc), m_start(Clock::now())
{
    if (!m_file)
        throw ProgramError(kExitOutput, "trace file '" + path + "': cannot be opened for writing");
    m_file << '[';
}

TraceFile::~TraceFile()
{
    writeEnd();
}

void TraceFile::writeEnd()
{
    if (!m_file.is_open())
        return;
    m_file << "\n]\n";
    m_file.close();
}

void TraceFile::close()
{
    writeEnd();
    if (!m_file)
        throw ProgramError(kExitOutput, "trace file '" + m_path + "': cannot be written");
}

void TraceFile::beginEvent()
{
    m_file << (m_isFirst ? "\n" : ",\n");
    m_isFirst = false;
}

int TraceFile::addLane(const std::string& name)
{
    const int lane = ++m_laneCount;
    beginEvent();
    m_file << R"({"ph":"M","name":"thread_name","pid":1,"tid":)" << lane << R"(,"args":{"name":)"
           << nlohmann::json(name).dump() << "}}";
    return lane;
}

void TraceFile::addSpan(int lane, const char* name, Clock::time_point begin, Clock::time_point end)
{
    const auto microseconds = [](Clock::duration time)
    { return std::chrono::duration<double, std::micro>(time).count(); };
    char times[96];
    std::snprintf(times, sizeof(times), R"(,"ts":%.3f,"dur":%.3f})", microseconds(begin - m_start),
                  microseconds(end - begin));
    beginEvent();
    m_file << R"({"ph":"X","pid":1,"tid":)" << lane << R"(,"name":)" << nlohmann::json(name).dump() << times;
}

TraceLane::TraceLane(TraceFile* file, const std::string& name)
    : m_file(file), m_lane(file != nullptr ? file->addLane(name) : 0)
{
}
}  // namespace cullet
