// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface that find pairs of boxes in CPU memory.
#include "cullet/abi/box_set.h"
#include "cullet/abi/status.h"

using namespace cullet;
using namespace cullet::abi;

struct cullet_box_set
{
    BoxSet set;
};

namespace
{
static_assert(sizeof(cullet_pair) == sizeof(Pair), "pairs are handed out as they are");

std::unique_ptr<Backend> makeBackend(std::int32_t choice, int threads)
{
    GridOptions grid;
    grid.threads = threads;
    if (choice == CULLET_BACKEND_AUTO || choice == CULLET_BACKEND_GRID)
        return makeGridBackend(grid);
    if (choice == CULLET_BACKEND_BRUTE)
        return makeBruteForceBackend();
    require(choice == CULLET_BACKEND_CUDA, CULLET_ERROR_ARGUMENT,
            "backend: one of CULLET_BACKEND_* expected");
    std::string why;
    if (std::unique_ptr<Backend> cuda = makeCudaPsapBackend({}, &why))
        return cuda;
    throw Failure{CULLET_ERROR_NO_DEVICE, "no CUDA backend: " + why};
}

/// @pre count > 0
BoxArray toArray(const float* boxes, std::size_t stride, std::uint32_t count)
{
    requirePointer(boxes, "boxes is NULL");
    require(stride == 0 || stride >= sizeof(Aabb), CULLET_ERROR_SIZE, "stride: at least 24 bytes expected");
    const std::size_t used = stride == 0 ? sizeof(Aabb) : stride;
    requireAddressable(sizeof(Aabb), used, count);
    return {boxes, used};
}

cullet_pairs toPairs(const Pairs& pairs)
{
    return {reinterpret_cast<const cullet_pair*>(pairs.data()), pairs.size()};
}

/// Makes the checks that all functions with ids share, and calls `change` if count > 0.
template <class Change>
cullet_status withIds(const cullet_box_set* set, const std::uint32_t* ids, std::uint32_t count,
                      const Change& change)
{
    return guarded(
        [&]() -> cullet_status
        {
            requirePointer(set, "set is NULL");
            if (count == 0)
                return CULLET_OK;
            requirePointer(ids, "ids is NULL");
            return change();
        });
}
}  // namespace

cullet_status cullet_box_set_create(const cullet_box_set_options* options, cullet_box_set** set)
{
    return guarded(
        [&]
        {
            requirePointer(set, "set is NULL");
            const auto known = readOptions<sizeof(cullet_box_set_options)>(options);
            require(known.margin >= 0, CULLET_ERROR_ARGUMENT, "margin: not negative and no NaN expected");
            const int threads = checkedThreads(known.threads);
            const float margin = checkedMargin(known.margin);
            *set = new cullet_box_set{BoxSet(makeBackend(known.backend, threads), threads, margin)};
            return CULLET_OK;
        });
}

void cullet_box_set_destroy(cullet_box_set* set)
{
    delete set;
}

cullet_status cullet_box_set_add(cullet_box_set* set, const float* boxes, size_t stride, uint32_t count,
                                 uint32_t* ids)
{
    return withIds(
        set, ids, count,
        [&]
        { return set->set.add(toArray(boxes, stride, count), count, ids) ? CULLET_OK : CULLET_EMPTY_BOXES; });
}

cullet_status cullet_box_set_move(cullet_box_set* set, const uint32_t* ids, const float* boxes, size_t stride,
                                  uint32_t count)
{
    return withIds(set, ids, count,
                   [&] {
                       return set->set.move(ids, toArray(boxes, stride, count), count) ? CULLET_OK
                                                                                       : CULLET_EMPTY_BOXES;
                   });
}

cullet_status cullet_box_set_filter(cullet_box_set* set, const uint32_t* ids, const cullet_filter* filters,
                                    uint32_t count)
{
    return withIds(set, ids, count,
                   [&]
                   {
                       requirePointer(filters, "filters is NULL");
                       set->set.setFilters(ids, filters, count);
                       return CULLET_OK;
                   });
}

cullet_status cullet_box_set_remove(cullet_box_set* set, const uint32_t* ids, uint32_t count)
{
    return withIds(set, ids, count,
                   [&]
                   {
                       set->set.remove(ids, count);
                       return CULLET_OK;
                   });
}

cullet_status cullet_box_set_update(cullet_box_set* set, cullet_pairs* added, cullet_pairs* removed)
{
    return guarded(
        [&]
        {
            requirePointer(set, "set is NULL");
            set->set.update();
            if (added != nullptr)
                *added = toPairs(set->set.delta().added);
            if (removed != nullptr)
                *removed = toPairs(set->set.delta().removed);
            return CULLET_OK;
        });
}

cullet_status cullet_box_set_pairs(const cullet_box_set* set, cullet_pairs* pairs)
{
    return guarded(
        [&]
        {
            requirePointer(set, "set is NULL");
            requirePointer(pairs, "pairs is NULL");
            *pairs = toPairs(set->set.pairs());
            return CULLET_OK;
        });
}

cullet_status cullet_box_set_get_stats(const cullet_box_set* set, cullet_box_set_stats* stats)
{
    return guarded(
        [&]
        {
            requirePointer(set, "set is NULL");
            requireResult<sizeof(cullet_box_set_stats)>(stats);
            cullet_box_set_stats known{};
            set->set.fill(known);
            writeResult(known, stats);
            return CULLET_OK;
        });
}
