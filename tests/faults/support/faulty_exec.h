// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/faults/support/faults.h"

#include <utility>

namespace cullet::test
{
/// HostExec whose calls fail as those of a GPU do: without memory, or with the device.
class FaultyExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

// A call of the executor, with any arguments, that may fail before it begins.
#define CULLET_FAULTY_CALL(name)                               \
    template <class... Arguments>                              \
    void name(Arguments&&... arguments)                        \
    {                                                          \
        failInCall(#name);                                     \
        HostExec::name(std::forward<Arguments>(arguments)...); \
    }
    CULLET_FAULTY_CALL(reserve)
    CULLET_FAULTY_CALL(reserveKeeping)
    CULLET_FAULTY_CALL(copy)
    CULLET_FAULTY_CALL(upload)
    CULLET_FAULTY_CALL(uploadParts)
    CULLET_FAULTY_CALL(awaitPart)
    CULLET_FAULTY_CALL(uploadAndWait)
    CULLET_FAULTY_CALL(download)
    CULLET_FAULTY_CALL(clear)
    CULLET_FAULTY_CALL(wait)
    CULLET_FAULTY_CALL(mark)
    CULLET_FAULTY_CALL(awaitMark)
    CULLET_FAULTY_CALL(fork)
    CULLET_FAULTY_CALL(join)
    CULLET_FAULTY_CALL(beginStage)
    CULLET_FAULTY_CALL(forEach)
    CULLET_FAULTY_CALL(forEachFrom)
    CULLET_FAULTY_CALL(forEachAppend)
    CULLET_FAULTY_CALL(forEachAppendWarp)
    CULLET_FAULTY_CALL(forEachPartition)
    CULLET_FAULTY_CALL(forEachMultiAppend)
    CULLET_FAULTY_CALL(forEachCompacted)
    CULLET_FAULTY_CALL(forEachWarp)
    CULLET_FAULTY_CALL(placeInTiles)
    CULLET_FAULTY_CALL(searchTiles)
    CULLET_FAULTY_CALL(exclusiveSum)
    CULLET_FAULTY_CALL(sortPairs)
    CULLET_FAULTY_CALL(sortKeys)
#undef CULLET_FAULTY_CALL

    template <std::uint32_t kSharers, class Step>
    void forEachBinSlot(std::uint64_t bins, const Step& step, const psap::PairList& list)
    {
        failInCall("forEachBinSlot");
        HostExec::forEachBinSlot<kSharers>(bins, step, list);
    }

private:
    static void failInCall(const char* call)
    {
        if (isNextFault(FaultKind::DeviceMemory))
            throw psap::ExecutorFailure{Status::OutOfMemory, call, "out of memory"};
        if (isNextFault(FaultKind::DeviceLoss))
            throw psap::ExecutorFailure{Status::DeviceLost, call, "device lost"};
    }
};
}  // namespace cullet::test
