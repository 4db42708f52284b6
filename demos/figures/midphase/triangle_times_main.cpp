// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_triangle_times [TRIANGLES...]: times of pairs of triangles of two sheets that deform, on the CPU and on a device.

#include "cullet/demos/figures/midphase/triangle_motion.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

namespace
{
using namespace cullet;

void print(const char* name, const TriangleMotion& motion, TriangleTimes times)
{
    if (times.ms.empty())
        return;
    std::sort(times.ms.begin(), times.ms.end());
    std::printf("%9u triangles, %-14s median %9.4f ms, least %9.4f ms, %9.0f pairs a frame, hash %016llx\n",
                TriangleMotion::kSheets * motion.triangles(), name, times.ms[times.ms.size() / 2],
                times.ms.front(), static_cast<double>(times.pairs) / static_cast<double>(times.ms.size()),
                static_cast<unsigned long long>(times.hash));
    std::fflush(stdout);
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        std::vector<std::uint32_t> sizes;
        for (int i = 1; i < argc; ++i)
            sizes.push_back(static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)));
        if (sizes.empty())
            sizes = {10000, 100000, 1000000};
        for (const std::uint32_t size : sizes)
        {
            const TriangleMotion motion(size, 15);
            print("wide tree", motion, timeWideTree(motion));
            print("linear, built", motion, timeLinearTree(motion, false));
            print("linear, refitted", motion, timeLinearTree(motion, true));
            print("device, built", motion, timeDeviceTrees(motion, false));
            print("device, refitted", motion, timeDeviceTrees(motion, true));
        }
    }
    catch (const std::exception& error)
    {
        std::fprintf(stderr, "%s\n", error.what());
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
