// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The NVTX ranges of an update as a profiler receives them. This program is the profiler itself.

#if __has_include(<nvtx3/nvToolsExt.h>)
#include "cullet/tests/cuda/support/box_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nvtx3/nvToolsExt.h>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Ranges of a thread, in the order in which they were opened.
struct SeenRanges
{
    std::vector<std::string> names;
    int open = 0;
    int mostOpen = 0;
};

SeenRanges& seen()
{
    // Thread-local, since other tests of this program use backends on several threads.
    static thread_local SeenRanges ranges;
    return ranges;
}

int NVTX_API pushed(const char* name)
{
    seen().names.emplace_back(name);
    seen().mostOpen = std::max(seen().mostOpen, ++seen().open);
    return seen().open - 1;
}
int NVTX_API popped()
{
    return --seen().open;
}

/// Called like the entry point of a profiler's library.
int NVTX_API watchRanges(NvtxGetExportTableFunc_t getExportTable)
{
    const auto* callbacks = static_cast<const NvtxExportTableCallbacks*>(getExportTable(NVTX_ETID_CALLBACKS));
    NvtxFunctionTable table = nullptr;
    unsigned int size = 0;
    if (callbacks == nullptr || callbacks->GetModuleFunctionTable(NVTX_CB_MODULE_CORE, &table, &size) == 0 ||
        size <= NVTX_CBID_CORE_RangePop)
        return 0;
    *table[NVTX_CBID_CORE_RangePushA] = reinterpret_cast<NvtxFunctionPointer>(pushed);
    *table[NVTX_CBID_CORE_RangePop] = reinterpret_cast<NvtxFunctionPointer>(popped);
    return 1;
}

// NVTX reads this variable when the first range opens, to find a profiler linked into the program.
const bool g_isWatching = (InitializeInjectionNvtx2_fnptr = watchRanges) != nullptr;

TEST(CudaRanges, NameTheStagesOfAnUpdate)
{
    ASSERT_TRUE(g_isWatching);
    PsapOptions options;
    options.nearPairs = PsapNearPairs::Never;
    const auto backend = makeCudaPsapBackend(options);
    ASSERT_NE(backend, nullptr);
    seen() = {};
    EXPECT_GT(follow(*backend, framesOf(SceneKind::Uniform, 1000, 1)).added, 100u);
    EXPECT_EQ(seen().names, (std::vector<std::string>{"upload", "sort", "settle", "search", "deltas"}));
    EXPECT_EQ(seen().open, 0);
    EXPECT_EQ(seen().mostOpen, 1);
}
}  // namespace
}  // namespace cullet::test
#endif
