// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The painter of a build without OSMesa.
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/render/painter.h"

namespace cullet
{
namespace
{
[[noreturn]] void refuse()
{
    throw ProgramError(kExitUnavailable,
                       "this program was built without a renderer; install libosmesa6-dev and libpng-dev, "
                       "and build it again");
}
}  // namespace

struct Painter::Parts
{
};

Painter::Painter(const Film&, int, int)
{
    refuse();
}

Painter::~Painter() = default;

Image Painter::paint(const FilmFrame&, const FilmState&, const Camera&)
{
    refuse();
}

void writePng(const Image&, const std::string&)
{
    refuse();
}

Image readPng(const std::string&)
{
    refuse();
}

bool hasPainter()
{
    return false;
}
}  // namespace cullet
