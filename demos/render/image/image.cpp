// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/image/image.h"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace cullet
{
namespace
{
/// Sum of the differences in a square, and its number of channels.
std::pair<double, int> blockDifference(const Image& a, const Image& b, int left, int top)
{
    double sum = 0;
    int count = 0;
    for (int y = top; y < std::min(top + ImageDifference::kBlock, a.height); ++y)
    {
        for (int x = left; x < std::min(left + ImageDifference::kBlock, a.width); ++x)
        {
            for (int channel = 0; channel < 3; ++channel, ++count)
                sum += std::abs(a.at(x, y)[channel] - b.at(x, y)[channel]);
        }
    }
    return {sum, count};
}
}  // namespace

Image shrink(const Image& image, int factor)
{
    Image small{image.width / factor, image.height / factor, {}};
    small.pixels.reserve(std::size_t(small.width) * small.height * 3);
    for (int y = 0; y < small.height; ++y)
    {
        for (int x = 0; x < small.width; ++x)
        {
            int sum[3] = {0, 0, 0};
            for (int dy = 0; dy < factor; ++dy)
            {
                const std::uint8_t* pixel = image.at(x * factor, y * factor + dy);
                for (int i = 0; i < 3 * factor; ++i)
                    sum[i % 3] += pixel[i];
            }
            const int area = factor * factor;
            for (const int channel : sum)
                small.pixels.push_back(static_cast<std::uint8_t>((channel + area / 2) / area));
        }
    }
    return small;
}

ImageDifference compareImages(const Image& a, const Image& b)
{
    if (a.width != b.width || a.height != b.height)
        throw std::invalid_argument("pictures of different sizes");
    ImageDifference difference;
    double total = 0;
    for (int top = 0; top < a.height; top += ImageDifference::kBlock)
    {
        for (int left = 0; left < a.width; left += ImageDifference::kBlock)
        {
            const auto [sum, count] = blockDifference(a, b, left, top);
            total += sum;
            difference.largest = std::max(difference.largest, sum / count);
        }
    }
    difference.mean = total / std::max<double>(1, static_cast<double>(a.pixels.size()));
    return difference;
}
}  // namespace cullet
