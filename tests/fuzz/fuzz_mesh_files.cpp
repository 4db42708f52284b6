// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Mesh files, valid and damaged: a mesh with finite coordinates or an error with the file's name, within limits of time and
// memory, whatever happens in the mesh library.

#include "cullet/demos/scenes/hulls/mesh_file.h"
#include "cullet/demos/scenes/hulls/mesh_hull.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/fuzz_target.h"
#include "cullet/tests/fuzz/largest_new.h"
#include "cullet/tests/fuzz/mesh_files/mesh_writer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace cullet::test
{
const char* const kFuzzTargetName = "mesh_files";

namespace
{
/// Less than the product allows, so that a file that hangs costs little.
constexpr MeshLimits kLimits = {0.5, std::uint64_t{1} << 28};
/// A process that is stopped at the limit, on a busy machine.
constexpr double kMostSeconds = 20;

/// A file that is deleted with this object.
class MeshFile
{
public:
    MeshFile(const std::string& bytes, const std::string& extension)
        : m_path((std::filesystem::temp_directory_path() /
                  ("cullet_fuzz_" + std::to_string(getpid()) + "." + extension))
                     .string())
    {
        std::ofstream(m_path, std::ios::binary) << bytes;
    }
    MeshFile(const MeshFile&) = delete;
    MeshFile& operator=(const MeshFile&) = delete;
    ~MeshFile() { std::remove(m_path.c_str()); }

    const std::string& path() const { return m_path; }

private:
    std::string m_path;
};

std::size_t openFiles()
{
    const std::filesystem::directory_iterator files("/proc/self/fd");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

/// One file through the reader and the reduction.
class FileCheck
{
public:
    explicit FileCheck(const std::string& path) : m_path(path) {}

    /// @return what is wrong, or an empty string
    std::string run()
    {
        const auto start = std::chrono::steady_clock::now();
        const std::size_t files = openFiles();
        resetLargestNew();
        read();
        const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
        if (!m_fault.empty())
            return m_fault;
        if (time.count() > kMostSeconds)
            return "takes " + std::to_string(time.count()) + " s";
        if (largestNew() > 2 * kLimits.bytes)
            return "allocates " + std::to_string(largestNew()) + " bytes";
        if (waitpid(-1, nullptr, WNOHANG) != -1)
            return "leaves a process behind";
        return openFiles() == files ? "" : "leaves a file open";
    }

    bool isRead() const { return m_isRead; }
    const std::vector<Point>& vertices() const { return m_vertices; }

private:
    void read()
    {
        try
        {
            m_vertices = readMeshVertices(m_path, kLimits);
            m_isRead = true;
            checkHull(reduceToHull(m_path, m_vertices));
        }
        catch (const MeshError& error)
        {
            checkMessage(error.what());
        }
    }

    void checkMessage(const std::string& message)
    {
        if (message.rfind("mesh '" + m_path + "': ", 0) != 0 || message.find('\n') != std::string::npos)
            m_fault = "a message without the file's name, or of two lines: " + message;
    }

    void checkHull(const HullPoints& hull)
    {
        for (const Point& point : hull.points)
        {
            for (const float coordinate : point)
            {
                if (!(std::fabs(coordinate) <= 1.001f))
                    m_fault = "a hull of size 1 has the coordinate " + std::to_string(coordinate);
            }
        }
        if (hull.points.size() < 4 || hull.points.size() > kMaxHullPoints)
            m_fault = "a hull has " + std::to_string(hull.points.size()) + " points";
    }

    const std::string& m_path;
    std::vector<Point> m_vertices;
    bool m_isRead = false;
    std::string m_fault;
};

/// A file as the operations of an input say.
class Session
{
public:
    std::string run(Choices& choices)
    {
        m_format = static_cast<MeshFormat>(choices.below(static_cast<std::uint32_t>(MeshFormat::kCount)));
        choices.nextOperation();
        for (; !choices.isEmpty(); choices.nextOperation())
            operate(choices);
        while (m_vertices.size() < 4)
            m_vertices.push_back({float(m_vertices.size() == 1), float(m_vertices.size() == 2), 1.0f});
        std::string bytes = MeshWriter(m_vertices).write(m_format);
        for (const Damage& damage : m_damages)
            apply(damage, bytes);
        const MeshFile file(bytes, extensionOf(m_format));
        FileCheck check(file.path());
        const std::string fault = check.run();
        return fault.empty() && m_damages.empty() ? checkValid(check) : fault;
    }

private:
    struct Damage
    {
        std::uint32_t kind;
        std::uint32_t place;  ///< of 65536 parts of the file
        std::uint32_t length;
        std::uint8_t value;
    };

    void operate(Choices& choices)
    {
        const std::uint32_t kind = choices.below(16);
        if (kind < 10 || m_vertices.size() < 4)
            return addVertex(choices);
        Damage damage;
        damage.kind = kind - 10;
        damage.place = choices.below(65536);
        damage.length = choices.below(64);
        damage.value = choices.byte();
        m_damages.push_back(damage);
    }

    void addVertex(Choices& choices)
    {
        Point point;
        for (float& coordinate : point)
            coordinate = choices.coordinate(true);
        m_vertices.push_back(point);
    }

    static void apply(const Damage& damage, std::string& bytes)
    {
        const std::size_t at = bytes.size() * damage.place / 65536;
        const std::size_t end = std::min(at + damage.length, bytes.size());
        if (damage.kind == 0)
            replaceWord(at, damage.value, bytes);
        else if (damage.kind == 1 && at < bytes.size())
            bytes[at] = static_cast<char>(damage.value);
        else if (damage.kind == 2)
            bytes.erase(at, end - at);
        else if (damage.kind == 3)
            bytes.insert(at, bytes.substr(at, end - at));
        else if (damage.kind == 4)
            bytes.resize(at);
        else
            bytes.insert(at, bytes.substr(0, at).substr(0, 4096));
    }

    /// Puts a number that files do not expect in the place of a word.
    static void replaceWord(std::size_t at, std::uint8_t value, std::string& bytes)
    {
        static const char* const kWords[] = {
            "nan",   "inf",        "-1",         "0",           "1e39",       "-3e38",
            "1e-46", "4294967295", "2147483647", "-2147483648", "400000000",  "18446744073709551616",
            "",      "1000000",    "#g",         "1e400",       "0x7fffffff", "99999999999999999999999999"};
        const char* const kEnds = " \n\t<>\"/";
        const std::size_t begin = bytes.find_first_not_of(kEnds, bytes.find_first_of(kEnds, at));
        if (begin == std::string::npos)
            return;
        const std::size_t end = std::min(bytes.find_first_of(kEnds, begin), bytes.size());
        bytes.replace(begin, end - begin, kWords[value % std::size(kWords)]);
    }

    /// A valid file is read, with no other vertices than its own.
    std::string checkValid(const FileCheck& check) const
    {
        const auto isFinite = [](const Point& p)
        { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); };
        if (!std::all_of(m_vertices.begin(), m_vertices.end(), isFinite))
            return "";
        if (!check.isRead())
            return "a valid file is not read";
        for (const Point& vertex : check.vertices())
        {
            const auto isNear = [&](const Point& p)
            { return isClose(p[0], vertex[0]) && isClose(p[1], vertex[1]) && isClose(p[2], vertex[2]); };
            if (!std::any_of(m_vertices.begin(), m_vertices.end(), isNear))
                return "a vertex is not in the file: " + std::to_string(vertex[0]) + ' ' +
                       std::to_string(vertex[1]) + ' ' + std::to_string(vertex[2]);
        }
        return "";
    }

    /// The mesh library rounds decimal numbers more than once, and small ones to 0.
    static bool isClose(float a, float b)
    {
        return std::fabs(double(a) - double(b)) <= 1e-5 * std::fabs(double(a)) + 1e-15;
    }

    MeshFormat m_format = MeshFormat::Obj;
    std::vector<Point> m_vertices;
    std::vector<Damage> m_damages;
};

/// The extension of a file by its first bytes; none for operations.
std::string extensionOfFile(const std::string& bytes)
{
    static const std::pair<const char*, const char*> kHeads[] = {
        {"ply", "ply"}, {"OFF", "off"}, {"solid", "stl"}, {"<?xml", "dae"}, {"v ", "obj"}, {"# ", "obj"}};
    for (const auto& [head, extension] : kHeads)
    {
        if (bytes.rfind(head, 0) == 0)
            return extension;
    }
    return "";
}
}  // namespace

std::string runFuzzInput(const std::uint8_t* data, std::size_t size)
{
    const std::string bytes(data, data + size);
    const std::string extension = extensionOfFile(bytes);
    if (!extension.empty())
    {
        const MeshFile file(bytes, extension);
        return FileCheck(file.path()).run();
    }
    Choices choices(data, size);
    return Session().run(choices);
}
}  // namespace cullet::test
