// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_convex_file FILE mixed|touching PAIRS VERTICES: writes pairs of convex hulls and cullet's depths to a file, the
// pairs of cullet_convex_times. Of mixed ones 80 % are apart, 15 % nearly touch, and 5 % overlap; touching ones all do.

#include "cullet/demos/bench/narrow/convex_file.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

int main(int argc, char** argv)
{
    const bool isTouching = argc == 5 && std::strcmp(argv[2], "touching") == 0;
    if (argc != 5 || (!isTouching && std::strcmp(argv[2], "mixed") != 0))
    {
        std::fprintf(stderr, "usage: cullet_convex_file FILE mixed|touching PAIRS VERTICES\n");
        return 2;
    }
    try
    {
        cullet::ConvexMotionOptions options;
        options.frames = 1;
        options.pairs = static_cast<std::uint32_t>(std::strtoul(argv[3], nullptr, 10));
        options.vertices = std::atoi(argv[4]);
        if (isTouching)
            options.shares = {0, 0};
        const cullet::ConvexFileSums sums =
            cullet::writeConvexFile(cullet::ConvexMotion(options), 0, argv[1]);
        std::printf("%u pairs, %u overlap, %.3f points a contact\n", options.pairs, sums.overlapping,
                    sums.pointsPerContact);
    }
    catch (const std::exception& error)
    {
        std::fprintf(stderr, "%s\n", error.what());
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
