// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cullet
{
/// Spans of time as a Chrome trace (a JSON array of complete events), which Perfetto and chrome://tracing show.
///
/// Events are written at once and not kept in memory. close() ends the array; if an exception ends the run, the
/// destructor does so and ignores failures. The viewers also read the incomplete file of a killed process.
class TraceFile
{
public:
    /// @throws ProgramError (kExitOutput) when the file cannot be opened
    explicit TraceFile(const std::string& path);
    ~TraceFile();
    TraceFile(const TraceFile&) = delete;
    TraceFile& operator=(const TraceFile&) = delete;

    using Clock = std::chrono::steady_clock;

    /// Adds a row below the others; returns its number.
    int addLane(const std::string& name);

    /// Ends the array; no event can be added afterwards.
    /// @throws ProgramError (kExitOutput) if a write has failed
    void close();

    void addSpan(int lane, const char* name, Clock::time_point begin, Clock::time_point end);

private:
    void beginEvent();
    void writeEnd();

    std::string m_path;
    std::ofstream m_file;
    Clock::time_point m_start;
    bool m_isFirst = true;
    int m_laneCount = 0;
};

/// Opens the trace file of a command line in `trace`; returns null for an empty path.
///
/// @throws as the constructor
inline TraceFile* openTrace(std::optional<TraceFile>& trace, const std::string& path)
{
    return path.empty() ? nullptr : &trace.emplace(path);
}

/// Closes the trace at the end of a successful run.
///
/// @throws as TraceFile::close()
inline void closeTrace(std::optional<TraceFile>& trace)
{
    if (trace.has_value())
        trace->close();
}

/// One row of a trace: nested spans. Without a file the functions have no effect.
class TraceLane
{
public:
    TraceLane() = default;
    TraceLane(TraceFile* file, const std::string& name);

    void add(const char* name, TraceFile::Clock::time_point begin, TraceFile::Clock::time_point end)
    {
        if (m_file != nullptr)
            m_file->addSpan(m_lane, name, begin, end);
    }

    void begin(const char* name, TraceFile::Clock::time_point now)
    {
        if (m_file != nullptr)
            m_open.emplace_back(name, now);
    }

    void end(TraceFile::Clock::time_point now)
    {
        if (m_open.empty())
            return;
        m_file->addSpan(m_lane, m_open.back().first, m_open.back().second, now);
        m_open.pop_back();
    }

private:
    TraceFile* m_file = nullptr;
    int m_lane = 0;
    std::vector<std::pair<const char*, TraceFile::Clock::time_point>> m_open;
};
}  // namespace cullet
