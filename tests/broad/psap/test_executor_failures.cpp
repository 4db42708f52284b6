// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Updates in which the executor's device fails.

#include "cullet/broad/log.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
/// HostExec whose wait() fails on demand.
class LosableExec : public psap::HostExec
{
public:
    LosableExec(const PsapOptions& options, bool& isLost) : HostExec(options), m_isLost(isLost) {}

    void wait()
    {
        if (m_isLost)
            throw psap::ExecutorFailure{Status::DeviceLost, "the call", "the reason"};
    }

private:
    bool& m_isLost;
};

TEST(PsapFailures, NameTheCallAndItsReasonWhenTheDeviceFails)
{
    static std::string logged;
    logged.clear();
    setLogFunction([](LogLevel, const char* message) { logged += message; });
    bool isLost = true;
    const PsapOptions options;
    psap::PsapBackend<LosableExec> backend(options, "backend", options, isLost);
    ProxyTable table;
    table.create(cube(0, 2), 1, kEverything);
    table.create(cube(1, 3), 2, kEverything);
    PairDelta delta;
    EXPECT_EQ(backend.update(table.beginUpdate(0, true), delta), Status::DeviceLost);
    EXPECT_TRUE(delta.added.empty());
    EXPECT_EQ(logged, "backend: the call: the reason");
    setLogFunction(nullptr);
    isLost = false;
    EXPECT_EQ(backend.update(table.beginUpdate(0, true), delta), Status::Ok);
    EXPECT_EQ(delta.added.size(), 1u);
}
}  // namespace
}  // namespace cullet::test
