// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/mesh_file.h"

#include "cullet/base/sanitizer.h"

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cullet
{
namespace
{
using Clock = std::chrono::steady_clock;

// First byte of the reading process's output; vertices or an error text follow.
constexpr char kVertices = 'V';
constexpr char kFailure = 'F';

[[noreturn]] void fail(const std::string& path, std::string reason)
{
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw MeshError("mesh '" + path + "': cannot be read: " + reason);
}

/// Both ends of a pipe; the destructor closes open ends.
class Pipe
{
public:
    Pipe() { m_isOpen = pipe(m_ends.data()) == 0; }
    ~Pipe()
    {
        closeEnd(0);
        closeEnd(1);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;

    bool isOpen() const { return m_isOpen; }
    int readEnd() const { return m_ends[0]; }
    int writeEnd() const { return m_ends[1]; }
    void closeWriteEnd() { closeEnd(1); }

private:
    void closeEnd(std::size_t end)
    {
        if (m_isOpen && m_ends[end] >= 0)
            close(m_ends[end]);
        m_ends[end] = -1;
    }

    std::array<int, 2> m_ends = {-1, -1};
    bool m_isOpen = false;
};

void send(int file, const void* data, std::size_t bytes)
{
    const char* next = static_cast<const char*>(data);
    while (bytes > 0)
    {
        const ssize_t sent = write(file, next, bytes);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            _exit(1);
        next += sent;
        bytes -= static_cast<std::size_t>(sent);
    }
}

void sendVertices(int file, const aiScene& scene)
{
    send(file, &kVertices, 1);
    for (unsigned int m = 0; m < scene.mNumMeshes; ++m)
    {
        const aiMesh& mesh = *scene.mMeshes[m];
        for (unsigned int v = 0; v < mesh.mNumVertices; ++v)
        {
            const Point point = {mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z};
            send(file, point.data(), sizeof point);
        }
    }
}

// Sanitizers reserve terabytes of addresses.
#ifdef CULLET_IS_SANITIZED
void limitAddressSpace(std::uint64_t) {}
#else
/// Limits the growth of this process's address space in bytes.
void limitAddressSpace(std::uint64_t bytes)
{
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t space = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) + bytes;
    const rlimit memory = {space, space};
    setrlimit(RLIMIT_AS, &memory);
}
#endif

/// Called first in the reading process.
void limitSelf(const MeshLimits& limits)
{
    // Ctrl-C reaches both processes; only the waiting process handles it, and its end terminates this process.
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_IGN);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit noCore = {0, 0};
    setrlimit(RLIMIT_CORE, &noCore);
    limitAddressSpace(limits.bytes);
}

/// Body of the reading process; never returns, so that no buffer or object of its parent is flushed or destroyed twice.
[[noreturn]] void readAndSend(const std::string& path, const MeshLimits& limits, int file)
{
    limitSelf(limits);
    std::string reason;
    try
    {
        Assimp::Importer importer;
        const aiScene* scene = importer.ReadFile(path, aiProcess_PreTransformVertices);
        if (scene != nullptr)
        {
            sendVertices(file, *scene);
            _exit(0);
        }
        reason = importer.GetErrorString();
    }
    catch (const std::exception& error)
    {
        reason = error.what();
    }
    send(file, &kFailure, 1);
    send(file, reason.data(), reason.size());
    _exit(0);
}

/// Reads up to the end of the file; returns false at the deadline.
bool receive(int file, Clock::time_point deadline, std::vector<char>& received)
{
    std::array<char, 65536> buffer;
    while (true)
    {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
        pollfd waiting = {file, POLLIN, 0};
        const int ready =
            poll(&waiting, 1, static_cast<int>(std::clamp<long long>(left.count(), 0, 1 << 30)));
        if (ready < 0 && errno == EINTR)
            continue;
        if (ready <= 0)
            return false;
        const ssize_t count = read(file, buffer.data(), buffer.size());
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            return true;
        received.insert(received.end(), buffer.begin(), buffer.begin() + count);
    }
}

/// @return status from waitpid()
int waitFor(pid_t process)
{
    int status = 0;
    while (waitpid(process, &status, 0) < 0 && errno == EINTR)
    {
    }
    return status;
}

std::string secondsOf(double seconds)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.3g s", seconds);
    return text;
}

std::vector<Point> decode(const std::string& path, const std::vector<char>& received, int status)
{
    if (received.empty() || WIFSIGNALED(status) || WEXITSTATUS(status) != 0)
        fail(path, "the mesh library ends before it has read it");
    if (received.front() == kFailure)
        fail(path, std::string(received.begin() + 1, received.end()));
    std::vector<Point> vertices((received.size() - 1) / sizeof(Point));
    if (!vertices.empty())
        std::memcpy(vertices.data(), received.data() + 1, vertices.size() * sizeof(Point));
    return vertices;
}
}  // namespace

MeshLimits limitsForMesh(std::uint64_t fileBytes)
{
    const double megabytes = static_cast<double>(fileBytes) / 1e6;
    // A sparse file claims any size.
    const std::uint64_t counted = std::min(fileBytes, std::uint64_t{1} << 50);
    return {10.0 + megabytes, (std::uint64_t{1} << 30) + 100 * counted};
}

std::vector<Point> readMeshVertices(const std::string& path, const MeshLimits& limits)
{
    Pipe pipe;
    if (!pipe.isOpen())
        fail(path, "no pipe to the process that reads it");
    const Clock::time_point deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                          std::chrono::duration<double>(limits.seconds));
    const pid_t reader = fork();
    if (reader < 0)
        fail(path, "no process to read it");
    if (reader == 0)
        readAndSend(path, limits, pipe.writeEnd());
    pipe.closeWriteEnd();
    std::vector<char> received;
    const bool isComplete = receive(pipe.readEnd(), deadline, received);
    if (!isComplete)
        kill(reader, SIGKILL);
    const int status = waitFor(reader);
    if (!isComplete)
        fail(path, "takes longer than " + secondsOf(limits.seconds) + ", as a broken file does");
    return decode(path, received, status);
}
}  // namespace cullet
