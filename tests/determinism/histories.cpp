// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_histories: prints hashes of the same worlds for any machine, to compare with those of another one. Lines that begin
// with "pour" have Bullet's solver and the math library in them.
#include "cullet/tests/determinism/history.h"
#include "cullet/tests/determinism/machine_hashes.h"

#include <cstdio>

int main()
{
    using namespace cullet::test;
    for (const std::string& line : machineHashes())
        std::printf("%s\n", line.c_str());
    for (const Narrow narrow : {Narrow::IsaGjk, Narrow::Dispatcher})
        std::printf("%s\n", worldHashes("pour", HistoryScene::Pour, narrow).c_str());
    return 0;
}
