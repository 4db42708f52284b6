// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

// Files that record the calls of a broad phase: boxes that are created, set and destroyed, frame by frame.
// docs/recording-format.md describes them byte by byte. The library cullet::box_stream reads and writes them by zlib; built
// without it, a writer's error(), and what open() of a reader says, name what is missing.
namespace cullet
{
/// A box in the precision in which it was recorded; a float is kept exactly. Length unit of the recorded world. May be
/// empty (min > max, or a NaN), as in Aabb.
struct StreamBox
{
    double min[3];
    double max[3];
};

/// One call of a broad phase.
struct BoxEvent
{
    enum class Kind : std::uint8_t
    {
        Create = 1,  ///< id, box, group, mask
        Destroy,     ///< id
        Set,         ///< id, box: also a box that is the same as before
        Filter,      ///< id, group, mask: changed without a call, detected before the next frame
        Frame        ///< the broad phase finds the pairs
    };

    Kind kind = Kind::Frame;
    std::uint32_t id = 0;
    std::int32_t group = 0;
    std::int32_t mask = 0;
    StreamBox box = {};
};

/// Size of a recorded coordinate, in bytes.
enum class StreamPrecision : std::uint8_t
{
    Float = 4,
    Double = 8
};

/// The contents of a file's head.
struct BoxStreamInfo
{
    StreamPrecision precision = StreamPrecision::Float;
    std::uint64_t frames = 0;
    std::uint64_t events = 0;  ///< frames included
    std::uint32_t ids = 0;     ///< every id is below this number
};

/// Writes a recording. Ids are chosen by the caller: the smallest that no live box has, so that they stay dense.
///
/// Errors: only the constructor throws, std::bad_alloc. The first failure (a full disk, no memory for an event) is kept
/// in error(), and all later calls do nothing.
/// Cost: O(1) per event, and zlib's fastest compression, per block of at most 1 MiB.
class BoxStreamWriter
{
public:
    /// Opens the file for writing; if that fails, error() is not empty.
    BoxStreamWriter(const std::string& path, StreamPrecision precision);

    /// Finishes, if finish() was not called.
    ~BoxStreamWriter();
    BoxStreamWriter(const BoxStreamWriter&) = delete;
    BoxStreamWriter& operator=(const BoxStreamWriter&) = delete;

    void create(std::uint32_t id, const StreamBox& box, std::int32_t group, std::int32_t mask) noexcept;
    void destroy(std::uint32_t id) noexcept;
    void set(std::uint32_t id, const StreamBox& box) noexcept;
    void filter(std::uint32_t id, std::int32_t group, std::int32_t mask) noexcept;
    void frame() noexcept;

    /// Ends the recording with an error, for a caller that has no memory to go on.
    void abandon() noexcept;

    /// Writes the remaining events, and the counts into the head. The reader refuses a file that was not finished.
    ///
    /// @returns whether everything is in the file
    bool finish() noexcept;

    /// One line that names the file and the reason; empty while all is well.
    const std::string& error() const noexcept;

    const BoxStreamInfo& info() const noexcept;

private:
    struct Parts;
    std::unique_ptr<Parts> m;
};

/// Limits of a reader. A block of equal events can be compressed to a thousandth of its size, so that the length of a
/// file does not bound its contents.
struct BoxStreamLimits
{
    std::uint32_t ids = 1u << 22;          ///< 48 bytes each
    std::uint32_t frameEvents = 1u << 22;  ///< of nextFrame(), without the Frame; 64 bytes each
};

/// Reads a recording and trusts nothing in it: each checksum, length, count and id is checked before it is used.
///
/// Memory: two blocks of 1 MiB, and as much as BoxStreamLimits allows. A file beyond a limit is an error that names it.
/// Errors: open() throws std::bad_alloc; for the others a lack of memory is an error of the file, too.
class BoxStreamReader
{
public:
    enum class Next
    {
        Event,
        End,   ///< the file ends as its head promises
        Error  ///< see error(); the events so far are good
    };

    /// @returns null when the file cannot be opened or has no valid head; `why` is then one line with its name
    static std::unique_ptr<BoxStreamReader> open(const std::string& path, std::string& why,
                                                 const BoxStreamLimits& limits = {});

    /// Reads from a stream instead, which error messages call `name`.
    static std::unique_ptr<BoxStreamReader> open(std::unique_ptr<std::istream> stream,
                                                 const std::string& name, std::string& why,
                                                 const BoxStreamLimits& limits = {});

    ~BoxStreamReader();
    BoxStreamReader(const BoxStreamReader&) = delete;
    BoxStreamReader& operator=(const BoxStreamReader&) = delete;

    const BoxStreamInfo& info() const noexcept;

    /// Reads one event into `event`. A Create has a free id, every other kind but Frame a live one.
    Next next(BoxEvent& event) noexcept;

    /// Replaces `events` by those up to the next Frame, without it. End: there is no further Frame; `events` has the
    /// events after the last one.
    Next nextFrame(std::vector<BoxEvent>& events) noexcept;

    /// One line that names the file, the place and the reason; empty while all is well.
    const std::string& error() const noexcept;

private:
    struct Parts;
    explicit BoxStreamReader(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> m;
};
}  // namespace cullet
