// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface that find pairs of boxes in GPU memory.
#include "cullet/abi/device_status.h"
#include "cullet/abi/status.h"
#include "cullet/cuda/device_pairs.h"

#include <memory>
#include <string>

using namespace cullet;
using namespace cullet::abi;

struct cullet_device_finder
{
    std::unique_ptr<DevicePairFinder> finder;
    bool hasSearch = false;
};

namespace
{
constexpr std::uint64_t kMostBoxes = 1u << 30;
}  // namespace

cullet_status cullet_device_finder_create(const cullet_device_finder_options* options,
                                          cullet_device_finder** finder)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            const auto known = readOptions<sizeof(cullet_device_finder_options)>(options);
            requireOrdinal(known.device);
            PsapOptions psap;
            psap.device = known.device;
            std::string why;
            auto made = makeDevicePairFinder(psap, static_cast<CUstream_st*>(known.stream), &why);
            requireMade(made.get(), why);
            *finder = new cullet_device_finder{std::move(made)};
            return CULLET_OK;
        });
}

void cullet_device_finder_destroy(cullet_device_finder* finder)
{
    delete finder;
}

cullet_status cullet_device_finder_enqueue(cullet_device_finder* finder, const float* device_boxes,
                                           uint64_t count)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            require(count == 0 || device_boxes != nullptr, CULLET_ERROR_NULL, "device_boxes is NULL");
            require(count < kMostBoxes, CULLET_ERROR_ARGUMENT, "2^30 boxes or more");
            finder->hasSearch = false;
            requireDevice(finder->finder->enqueue(reinterpret_cast<const Aabb*>(device_boxes), count));
            finder->hasSearch = true;
            return CULLET_OK;
        });
}

cullet_status cullet_device_finder_collect(cullet_device_finder* finder, cullet_pairs* device_pairs)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            requirePointer(device_pairs, "device_pairs is NULL");
            require(finder->hasSearch, CULLET_ERROR_ARGUMENT, "no enqueue before, or it failed");
            DevicePairs found;
            requireDevice(finder->finder->collect(found));
            *device_pairs = {reinterpret_cast<const cullet_pair*>(found.pairs), found.count};
            return CULLET_OK;
        });
}
