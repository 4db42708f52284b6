// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/recording/box_stream.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

// The bytes of a recording, as docs/recording-format.md describes them; shared by the writer and the reader.
namespace cullet::box_stream
{
using Bytes = std::vector<std::uint8_t>;

/// Bits of the six coordinates of a box, minimum first.
using BoxBits = std::array<std::uint64_t, 6>;

constexpr std::size_t kHeadSize = 48;
constexpr std::size_t kBlockHeadSize = 16;
constexpr std::size_t kMaxBlock = std::size_t(1) << 20;  ///< bytes of a block before compression
constexpr std::uint64_t kUnknownCount = ~std::uint64_t(0);

/// First byte of an event. SetSame is Set with an unchanged box.
enum class Code : std::uint8_t
{
    Create = 1,
    Destroy,
    Set,
    SetSame,
    Filter,
    Frame
};

/// Appends the lowest `size` bytes of a value, lowest first.
void put(Bytes& bytes, std::uint64_t value, std::size_t size);

/// The value of `size` bytes, lowest first.
std::uint64_t get(const std::uint8_t* bytes, std::size_t size);

BoxBits toBits(const StreamBox& box, StreamPrecision precision);
StreamBox fromBits(const BoxBits& bits, StreamPrecision precision);

Bytes encodeHead(const BoxStreamInfo& info);

/// @param bytes kHeadSize bytes
/// @returns what is wrong with it; empty when nothing is
std::string decodeHead(const std::uint8_t* bytes, BoxStreamInfo& info);

/// Compresses events into a block with its head. @pre events.size() <= kMaxBlock
Bytes packBlock(const Bytes& events);

/// The sizes stored in the head of a block.
struct BlockHead
{
    std::size_t unpackedSize = 0;
    std::size_t packedSize = 0;
};

/// @param bytes kBlockHeadSize bytes
/// @returns what is wrong with it; empty when nothing is
std::string decodeBlockHead(const std::uint8_t* bytes, BlockHead& head);

/// @param block head and packed bytes
/// @returns what is wrong with it; empty when nothing is
std::string unpackBlock(const Bytes& block, const BlockHead& head, Bytes& events);
}  // namespace cullet::box_stream
