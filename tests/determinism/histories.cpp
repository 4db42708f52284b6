// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_histories: prints hashes of the same worlds for any machine, to compare with those of another one. What
// docs/determinism.md promises for every machine stands in the lines that begin with "boxes" and "drift"; those that begin
// with "pour" have Bullet's solver and the math library in them.
#include "cullet/tests/determinism/box_history.h"
#include "cullet/tests/determinism/history.h"
#include "cullet/tests/support/number_hash.h"

#include <cstdio>

namespace cullet::test
{
namespace
{
void printBoxes()
{
    for (const SceneKind kind : kBoxScenes)
        std::printf("boxes %s %016llx\n", sceneName(kind),
                    static_cast<unsigned long long>(boxHistory(*makeGridBackend(), kind).back()));
}

void printWorld(const char* name, HistoryScene scene, Narrow narrow)
{
    HistoryOptions options;
    options.scene = scene;
    options.narrow = narrow;
    options.threads = 0;
    options.isParallelWorld = true;
    NumberHash pairs, contacts, bodies;
    for (const Fingerprint& step : historyOf(options))
    {
        pairs.add(step.pairs);
        contacts.add(step.contacts);
        bodies.add(step.bodies);
    }
    std::printf(
        "%s %s pairs %016llx contacts %016llx bodies %016llx\n", name,
        narrow == Narrow::IsaGjk ? "isa-gjk" : "dispatcher", static_cast<unsigned long long>(pairs.value()),
        static_cast<unsigned long long>(contacts.value()), static_cast<unsigned long long>(bodies.value()));
}
}  // namespace
}  // namespace cullet::test

int main()
{
    using namespace cullet::test;
    std::printf("scalar %d bytes\n", static_cast<int>(sizeof(btScalar)));
    printBoxes();
    for (const Narrow narrow : {Narrow::IsaGjk, Narrow::Dispatcher})
    {
        printWorld("drift", HistoryScene::Drift, narrow);
        printWorld("pour", HistoryScene::Pour, narrow);
    }
    return 0;
}
