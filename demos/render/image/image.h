// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
/// A picture of 8 bits per channel, rows from top to bottom.
struct Image
{
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> pixels;  ///< [height * width * 3] red, green, blue

    const std::uint8_t* at(int x, int y) const { return pixels.data() + 3 * (std::size_t(y) * width + x); }
};

/// The picture with each square of factor x factor pixels averaged; incomplete squares at the edges are dropped.
Image shrink(const Image& image, int factor);

/// @throws ProgramError (kExitOutput, kExitInput) with the file and the reason
void writePng(const Image& image, const std::string& path);
Image readPng(const std::string& path);

/// How two pictures differ, in steps of 255 for each channel.
struct ImageDifference
{
    double mean = 0;     ///< over all pixels
    double largest = 0;  ///< of the means over squares of kBlock x kBlock pixels
    static constexpr int kBlock = 8;
};

/// @throws std::invalid_argument if the sizes differ
ImageDifference compareImages(const Image& a, const Image& b);
}  // namespace cullet
