// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/recording/box_stream_format.h"

#include <cstring>
#include <zlib.h>

namespace cullet::box_stream
{
namespace
{
// As in PNG: a byte above 127, a name, and the line ends that a transfer as text would change.
constexpr std::uint8_t kMagic[8] = {0x89, 'C', 'B', 'X', '\r', '\n', 0x1a, '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr std::uint8_t kZlib = 1;
constexpr std::size_t kHeadChecked = kHeadSize - 4;  ///< all but the checksum at the end
constexpr std::size_t kBlockChecksumAt = 12;

std::uint32_t checksum(const std::uint8_t* bytes, std::size_t count)
{
    return static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0), bytes, static_cast<uInt>(count)));
}

/// Checksum of the two lengths and the packed bytes: of the whole block except its mark and the checksum itself.
std::uint32_t blockChecksum(const Bytes& block)
{
    const std::uint32_t head = checksum(block.data(), kBlockChecksumAt);
    return static_cast<std::uint32_t>(
        crc32(head, block.data() + kBlockHeadSize, static_cast<uInt>(block.size() - kBlockHeadSize)));
}

constexpr std::uint32_t kBlockMark = 0x4b4c4243;  // "CBLK"

template <class Float, class Word>
Word wordOf(double coordinate)
{
    const Float value = static_cast<Float>(coordinate);
    Word word;
    std::memcpy(&word, &value, sizeof(word));
    return word;
}

template <class Float, class Word>
double coordinateOf(std::uint64_t bits)
{
    const Word word = static_cast<Word>(bits);
    Float value;
    std::memcpy(&value, &word, sizeof(value));
    return static_cast<double>(value);
}
}  // namespace

void put(Bytes& bytes, std::uint64_t value, std::size_t size)
{
    for (std::size_t i = 0; i < size; ++i)
        bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint64_t get(const std::uint8_t* bytes, std::size_t size)
{
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
        value |= std::uint64_t(bytes[i]) << (8 * i);
    return value;
}

BoxBits toBits(const StreamBox& box, StreamPrecision precision)
{
    BoxBits bits;
    for (std::size_t i = 0; i < 6; ++i)
    {
        const double coordinate = i < 3 ? box.min[i] : box.max[i - 3];
        bits[i] = precision == StreamPrecision::Float ? wordOf<float, std::uint32_t>(coordinate)
                                                      : wordOf<double, std::uint64_t>(coordinate);
    }
    return bits;
}

StreamBox fromBits(const BoxBits& bits, StreamPrecision precision)
{
    StreamBox box;
    for (std::size_t i = 0; i < 6; ++i)
    {
        double& coordinate = i < 3 ? box.min[i] : box.max[i - 3];
        coordinate = precision == StreamPrecision::Float ? coordinateOf<float, std::uint32_t>(bits[i])
                                                         : coordinateOf<double, std::uint64_t>(bits[i]);
    }
    return box;
}

Bytes encodeHead(const BoxStreamInfo& info)
{
    Bytes head(kMagic, kMagic + sizeof(kMagic));
    put(head, kVersion, 4);
    put(head, kByteOrder, 4);
    put(head, static_cast<std::uint8_t>(info.precision), 1);
    put(head, kZlib, 1);
    put(head, 0, 2);
    put(head, info.frames, 8);
    put(head, info.events, 8);
    put(head, info.ids, 4);
    put(head, 0, kHeadChecked - head.size());
    put(head, checksum(head.data(), head.size()), 4);
    return head;
}

std::string decodeHead(const std::uint8_t* bytes, BoxStreamInfo& info)
{
    if (std::memcmp(bytes, kMagic, sizeof(kMagic)) != 0)
        return "not a recording of boxes (or one that was transferred as text)";
    const std::uint64_t version = get(bytes + 8, 4);
    if (version != kVersion)
        return "version " + std::to_string(version) + " of the format; this program reads version " +
               std::to_string(kVersion);
    if (get(bytes + kHeadChecked, 4) != checksum(bytes, kHeadChecked))
        return "the checksum of the head is wrong";
    const std::uint64_t precision = get(bytes + 16, 1);
    if (get(bytes + 12, 4) != kByteOrder || (precision != 4 && precision != 8) || get(bytes + 17, 1) != kZlib)
        return "byte order, precision or compression that version 1 does not have";
    info.precision = static_cast<StreamPrecision>(precision);
    info.frames = get(bytes + 20, 8);
    info.events = get(bytes + 28, 8);
    info.ids = static_cast<std::uint32_t>(get(bytes + 36, 4));
    if (info.frames == kUnknownCount)
        return "not finished: the program that recorded it ended too early";
    return "";
}

Bytes packBlock(const Bytes& events)
{
    uLongf packedSize = compressBound(static_cast<uLong>(events.size()));
    Bytes block(kBlockHeadSize + packedSize);
    // Cannot fail: the buffer has the largest size that zlib needs.
    compress2(block.data() + kBlockHeadSize, &packedSize, events.data(), static_cast<uLong>(events.size()),
              Z_BEST_SPEED);
    block.resize(kBlockHeadSize + packedSize);
    Bytes head;
    put(head, kBlockMark, 4);
    put(head, events.size(), 4);
    put(head, packedSize, 4);
    std::memcpy(block.data(), head.data(), head.size());
    put(head, blockChecksum(block), 4);
    // The head is copied again, now with the checksum.
    std::memcpy(block.data(), head.data(), head.size());
    return block;
}

std::string decodeBlockHead(const std::uint8_t* bytes, BlockHead& head)
{
    head.unpackedSize = get(bytes + 4, 4);
    head.packedSize = get(bytes + 8, 4);
    if (get(bytes, 4) != kBlockMark)
        return "no block where one has to be";
    if (head.unpackedSize == 0 || head.unpackedSize > kMaxBlock || head.packedSize > compressBound(kMaxBlock))
        return "a block of " + std::to_string(head.unpackedSize) + " bytes, packed " +
               std::to_string(head.packedSize) + ": at most " + std::to_string(kMaxBlock) + " are legal";
    return "";
}

std::string unpackBlock(const Bytes& block, const BlockHead& head, Bytes& events)
{
    if (get(block.data() + kBlockChecksumAt, 4) != blockChecksum(block))
        return "the checksum of a block is wrong";
    events.resize(head.unpackedSize);
    uLongf size = static_cast<uLong>(head.unpackedSize);
    const int result = uncompress(events.data(), &size, block.data() + kBlockHeadSize,
                                  static_cast<uLong>(block.size() - kBlockHeadSize));
    return result == Z_OK && size == head.unpackedSize ? "" : "a block cannot be unpacked";
}
}  // namespace cullet::box_stream
