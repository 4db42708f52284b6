// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/determinism/machine_hashes.h"

#include "cullet/tests/determinism/box_history.h"
#include "cullet/tests/determinism/history.h"
#include "cullet/tests/support/hull_answers.h"
#include "cullet/tests/support/number_hash.h"

#include <cstdio>

namespace cullet::test
{
namespace
{
std::string hex(std::uint64_t hash)
{
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
    return text;
}
}  // namespace

std::string worldHashes(const char* name, HistoryScene scene, Narrow narrow)
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
    return std::string(name) + (narrow == Narrow::IsaGjk ? " isa-gjk" : " dispatcher") + " pairs " +
           hex(pairs.value()) + " contacts " + hex(contacts.value()) + " bodies " + hex(bodies.value());
}

std::vector<std::string> machineHashes()
{
    std::vector<std::string> lines = {"scalar " + std::to_string(sizeof(btScalar)) + " bytes"};
    for (const SceneKind kind : kBoxScenes)
        lines.push_back(std::string("boxes ") + sceneName(kind) + " " +
                        hex(boxHistory(*makeGridBackend(), kind).back()));
    lines.push_back("hulls " + hex(hullAnswers<btScalar>().hash.value()));
    lines.push_back(worldHashes("drift", HistoryScene::Drift, Narrow::IsaGjk));
    lines.push_back(worldHashes("drift", HistoryScene::Drift, Narrow::Dispatcher));
    return lines;
}

const std::vector<std::string>& recordedHashes()
{
    static const std::vector<std::string> kFloat = {
        "scalar 4 bytes",
        "boxes Uniform 6f038a16543d821b",
        "boxes ManySizes d158ea200c40db48",
        "boxes MostlyStatic 252fef1a2a802820",
        "boxes Pile 4965ae7b9b2c5f3a",
        "boxes Teleport ee70aa760e1fb475",
        "hulls 4a558fa593ed0f06",
        "drift isa-gjk pairs 70a2266e90437657 contacts ed7e9eaddbab4a54 bodies 1e8f6f39db1dbdb8",
        "drift dispatcher pairs 70a2266e90437657 contacts c58d019184cf9b27 bodies 1e8f6f39db1dbdb8",
    };
    static const std::vector<std::string> kDouble = {
        "scalar 8 bytes",
        "boxes Uniform 6f038a16543d821b",
        "boxes ManySizes d158ea200c40db48",
        "boxes MostlyStatic 252fef1a2a802820",
        "boxes Pile 4965ae7b9b2c5f3a",
        "boxes Teleport ee70aa760e1fb475",
        "hulls 124a1c21f685169d",
        "drift isa-gjk pairs 70a2266e90437657 contacts 906ca30dec8d9432 bodies 8e5e8f5b930706af",
        "drift dispatcher pairs 70a2266e90437657 contacts 827f28516b12e4b4 bodies 8e5e8f5b930706af",
    };
    return sizeof(btScalar) == 4 ? kFloat : kDouble;
}
}  // namespace cullet::test
