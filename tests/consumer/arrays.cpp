// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Uses the backends on arrays of boxes and the queries on hulls, without Bullet.

#include <cstdio>
#include <cullet/broad/backend.h>
#include <cullet/broad/proxy_table.h>
#include <cullet/cuda/device_pairs.h>
#include <cullet/cuda/narrow/convex_pairs.h>
#include <cullet/cuda/narrow/hull_set.h>
#include <cullet/narrow/build/hull_builder.h>
#include <memory>
#include <string>

int main()
{
    cullet::ProxyTable table;
    const cullet::Filter all = {1, -1};
    table.create({{0, 0, 0}, {2, 1, 1}}, 1, all);
    table.create({{1, 0, 0}, {3, 1, 1}}, 2, all);
    table.create({{9, 0, 0}, {9, 1, 1}}, 3, all);
    const std::unique_ptr<cullet::Backend> grid = cullet::makeGridBackend();
    cullet::PairDelta delta;
    const cullet::Status status = grid->update(table.beginUpdate(0, true), delta);
    table.endUpdate();

    std::string why = "a CUDA device answers";
    const bool hasDevice = cullet::makeDevicePairFinder({}, nullptr, &why) != nullptr;
    cullet::HullSet hulls;
    hulls.add(cullet::makeHull<float>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
    const bool hasConvexPairs = cullet::makeDeviceConvexPairs(hulls, 0, nullptr, nullptr) != nullptr;
    std::printf("%zu pair, hull type of %zu bytes; CUDA: %s\n", delta.added.size(),
                sizeof(cullet::Hull<float>), why.c_str());
    const bool isRight = status == cullet::Status::Ok && delta.added.size() == 1 &&
                         delta.added[0] == cullet::Pair{1, 2} &&
                         hasDevice == (why == "a CUDA device answers") && hasConvexPairs == hasDevice &&
                         hulls.blockCount() == 4;
    return isRight ? 0 : 1;
}
