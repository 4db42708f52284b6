// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/render/image/image.h"

#include <png.h>

namespace cullet
{
namespace
{
png_image header(const Image& image)
{
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(image.width);
    png.height = static_cast<png_uint_32>(image.height);
    png.format = PNG_FORMAT_RGB;
    return png;
}

}  // namespace

void writePng(const Image& image, const std::string& path)
{
    png_image png = header(image);
    if (png_image_write_to_file(&png, path.c_str(), 0, image.pixels.data(), 0, nullptr) == 0)
        throw ProgramError(kExitOutput, "cannot write " + path + ": " + png.message);
}

Image readPng(const std::string& path)
{
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_file(&png, path.c_str()) == 0)
        throw ProgramError(kExitInput, "cannot read " + path + ": " + png.message);
    png.format = PNG_FORMAT_RGB;
    Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
    image.pixels.resize(PNG_IMAGE_SIZE(png));
    if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0)
        throw ProgramError(kExitInput, "cannot read " + path + ": " + png.message);
    return image;
}

}  // namespace cullet
