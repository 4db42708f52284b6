// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Fingerprints of the work that backends do in fixed scenes: box tests, entries, paths and costs of every update. Plans,
// modes and limits follow from counts, so that they are the same in each run; pairs do not show them.
//
// A failure here means that a backend plans, decides or searches otherwise than before. After a change of a cost or a
// plan insert the new values, and say in the commit what they gain. In all other cases a plan has become worse, or a
// mode begins too late, and nothing but time would tell.

#include "cullet/broad/proxy_table.h"
#include "cullet/comparison/comparison_stats.h"
#include "cullet/tests/broad/conformance/psap_cases.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/fnv1a.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// What a backend did in all updates of some scenes.
class WorkRecord
{
public:
    void add(const BackendStats& stats, const ComparisonStats& compared)
    {
        m_tests += stats.candidates;
        m_entries += stats.entries;
        addText(stats.path);
        for (const std::uint64_t count :
             {stats.candidates, stats.entries, stats.levels, stats.unbounded, stats.rebuildsTotal,
              stats.retriesTotal, compared.cellsTouched, stats.cellsVisited, compared.mostTests,
              compared.falsePairs, compared.swaps[0], compared.swaps[1], compared.swaps[2], stats.bytesMoved,
              std::uint64_t{stats.decision.strays}})
            m_hash.add(count, sizeof count);
        addText(stats.decision.reason);
        for (const double number : {stats.decision.cost, stats.decision.otherCost, stats.decision.planCost,
                                    stats.decision.oneLevelCost, stats.decision.allLevelsCost})
            addRounded(static_cast<float>(number));
        addRounded(stats.decision.cellWidth);
    }

    std::string text() const
    {
        std::ostringstream out;
        out << m_tests << " tests, " << m_entries << " entries, " << std::hex << m_hash.value();
        return out.str();
    }

private:
    void addText(const char* text)
    {
        for (; *text != 0; ++text)
            m_hash.add(static_cast<unsigned char>(*text), 1);
    }

    /// Without the last bits, in which sums of costs may be rounded.
    void addRounded(float number)
    {
        std::uint32_t bits;
        std::memcpy(&bits, &number, sizeof bits);
        m_hash.add(bits >> 4, sizeof bits);
    }

    std::uint64_t m_tests = 0;
    std::uint64_t m_entries = 0;
    Fnv1a m_hash;
};

/// Boxes that rest, jitter, move and jump by turns, of a few sizes, with some far away, large, empty or unbounded.
class TurningScene
{
public:
    explicit TurningScene(std::uint32_t seed) : m_random(seed)
    {
        for (std::uint32_t row = 0; row < kCount; ++row)
            table.create(randomBox(row), row + 1, kEverything);
    }

    void step(int number)
    {
        // Resting several times: boxes that are awake come to rest, and a mode that did not pay is tried again.
        constexpr std::uint32_t kOneInMany[] = {0, 6, 0, 0, 0, 3, 1, 0, 8, 1};
        constexpr float kStride[] = {0, 0.5f, 0, 0, 0, 0.25f, 0.125f, 0, 0.0625f, 20};
        const std::size_t turn = static_cast<std::size_t>(number) / kStepsOfTurn % std::size(kOneInMany);
        if (number % 17 == 16)
            return;
        if (number == kFirstDouble)
            margin *= 2;
        if (number == kSteps - 3)
            table.setFilter(0, {2, 1});
        for (std::uint32_t row = 0; row < kCount; ++row)
        {
            const bool moves = kOneInMany[turn] != 0 && row % kOneInMany[turn] == 0;
            const float stride = moves ? kStride[turn] : kJitter;
            const float x = m_random.between(-stride, stride);
            const float y = m_random.between(-stride, stride);
            const float z = m_random.between(-stride, stride);
            if (moves || (row % 4 != 0 && row % 6 != 0))
                table.setBox(row, translated(table.box(row), x, y, z));
        }
    }

    static constexpr int kSteps = 140, kStepsOfTurn = 14, kFirstDouble = 116;
    ProxyTable table;
    float margin = 0.0625f;

private:
    static constexpr std::uint32_t kCount = 900;
    static constexpr float kJitter = 1.0f / 256;

    Aabb randomBox(std::uint32_t row)
    {
        const float x = m_random.between(0, 30);
        const float y = m_random.between(0, 20);
        const float z = m_random.between(0, 10);
        switch (row % 100)
        {
            case 0:
                return boxAt(x, y, z, 6);
            case 1:
                return boxAt(100 * x, -50 * y, 70 * z);
            case 2:
                return row == 2 ? cube(-kInfinity, kInfinity) : boxAt(x, y, z, 1e20f);
            case 3:
                return {{1, 1, 1}, {-1, -1, -1}};
            default:
                return boxAt(x, y, z, row % 10 == 4 ? 0.0625f : 0.5f);
        }
    }

    Random m_random;
};

void recordUpdate(Backend& backend, ProxyTable& table, float margin, WorkRecord& record)
{
    PairDelta delta;
    ASSERT_EQ(backend.update(table.beginUpdate(margin, true), delta), Status::Ok);
    table.endUpdate();
    record.add(backend.stats(), comparisonStatsOf(backend));
}

void recordTurns(Backend& backend, int steps, WorkRecord& record)
{
    TurningScene scene(5);
    for (int step = 0; step < steps; ++step)
    {
        recordUpdate(backend, scene.table, scene.margin, record);
        scene.step(step);
    }
}

void recordScene(Backend& backend, SceneKind kind, int steps, WorkRecord& record)
{
    constexpr std::uint32_t kCount = 1500;
    BoxScene scene(kind, kCount, 2010);
    ProxyTable table;
    for (std::uint32_t body = 0; body < kCount; ++body)
        table.create(scene.boxes()[body], body + 1, body % 10 == 0 ? Filter{2, ~2} : kEverything);
    for (int step = 0; step < steps; ++step)
    {
        recordUpdate(backend, table, 0.03125f, record);
        scene.step();
        for (const std::uint32_t body : scene.moved())
            table.setBox(body, scene.boxes()[body]);
    }
}

/// Most boxes are small and close together, some are large, which pays a level of cells for each.
void recordLevels(Backend& backend, WorkRecord& record)
{
    constexpr std::uint32_t kCount = 4000;
    Random random(6);
    ProxyTable table;
    for (std::uint32_t row = 0; row < kCount; ++row)
    {
        const float half = row % 50 == 0 ? 3.0f : row % 5 == 0 ? 0.5f : 0.05f;
        table.create(boxAt(random.point(0, 20), half), row + 1, kEverything);
    }
    for (int step = 0; step < 3; ++step)
    {
        recordUpdate(backend, table, 0.03125f, record);
        for (std::uint32_t row = 0; row < kCount; row += 2)
            table.setBox(row, translated(table.box(row), random.point(-0.03125f, 0.03125f)));
    }
}

/// Cases whose counts do not depend on the machine: one thread, and no instruction set that tests more lanes at once.
std::vector<BackendCase> workCases()
{
    std::vector<BackendCase> cases = psapCases("Psap",
                                               [](SearchOptions options)
                                               {
                                                   options.threads = 1;
                                                   return makeHostBackend(options);
                                               });
    const auto add = [&](const char* name, const std::function<void(GridOptions&)>& change)
    {
        GridOptions options;
        options.threads = 1;
        options.baselineSimd = true;
        options.flatLimit = 0;
        change(options);
        cases.push_back({name, [options] { return makeGridBackend(options); }});
    };
    add("Grid", [](GridOptions&) {});
    add("GridCellScaleOne", [](GridOptions& options) { options.cellScale = 1; });
    add("GridAlwaysRebuild", [](GridOptions& options) { options.rebuildFraction = 0; });
    add("GridRebuildAtThirty", [](GridOptions& options) { options.rebuildFraction = 0.3f; });
    add("GridNeverRebuild", [](GridOptions& options) { options.rebuildFraction = 1; });
    add("GridNeverSettles", [](GridOptions& options) { options.settles = false; });
    add("GridOneLevel", [](GridOptions& options) { options.levels = 1; });
    add("GridThreeLevels", [](GridOptions& options) { options.levels = 3; });
    add("Flat", [](GridOptions& options) { options.flatLimit = 1u << 20; });
    const auto addCells = [&](const char* name, const std::function<void(CellsOptions&)>& change)
    {
        CellsOptions options;
        change(options);
        cases.push_back({name, [options] { return makeCellGridBackend(options); }});
    };
    addCells("Cells", [](CellsOptions&) {});
    addCells("CellsHalfWidth", [](CellsOptions& options) { options.cellScale = 0.5f; });
    addCells("CellsAlwaysRebuild", [](CellsOptions& options) { options.rebuildFraction = 0; });
    addCells("CellsNeverRebuild", [](CellsOptions& options) { options.rebuildFraction = 1; });
    addCells("CellsSimpleUpdate",
             [](CellsOptions& options)
             {
                 options.rebuildFraction = 1;
                 options.updatesByRemoveAndAdd = true;
             });
    addCells("CellsOwnLevel", [](CellsOptions& options) { options.placement = GridPlacement::OwnLevel; });
    addCells("CellsOnePoint", [](CellsOptions& options) { options.placement = GridPlacement::OnePoint; });
    addCells("UniformGrid", [](CellsOptions& options) { options.placement = GridPlacement::OneGrid; });
    addCells("CellsCountedPairs", [](CellsOptions& options) { options.countsPairs = true; });
    cases.push_back({"LeGrand", [] { return makeLeGrandBackend(); }});
    cases.push_back({"Sap", [] { return makeSapBackend(); }});
    return cases;
}

/// Name of a case: what it does in all scenes.
const std::map<std::string, std::string>& recordedWork()
{
    static const std::map<std::string, std::string> recorded = {
        {"PsapRows", "1296503 tests, 84000 entries, a27de6c9c3a0035a"},
        {"PsapRowsCapacityOne", "1417519 tests, 84000 entries, 66b8e4c84ac05a1d"},
        {"PsapRowsCounting", "1296503 tests, 84000 entries, a27de6c9c3a0035a"},
        {"PsapRowsGrouped", "428901 tests, 84000 entries, eaf0f2ef17de2cac"},
        {"PsapRowsGroupedCapacityOne", "466184 tests, 84000 entries, 5ee7a3923373dc1b"},
        {"PsapRowsBins", "1281969 tests, 84000 entries, 981e628c378d2bde"},
        {"PsapRowsBinsCapacityOne", "1301366 tests, 84000 entries, c42cf380ed08c3b1"},
        {"PsapRowsTiles", "1674784 tests, 84000 entries, 5b3813a9504fe702"},
        {"PsapRowsTilesCapacityOne", "1471204 tests, 84000 entries, a7f79d3133f6d462"},
        {"PsapRowsCountingPlannedOften", "1297518 tests, 84000 entries, cb04be795dd4be43"},
        {"PsapRowsCountingPlannedOftenCapacityOne", "1418516 tests, 84000 entries, 659810e724465646"},
        {"PsapRowsBinsPlannedOften", "1275397 tests, 84000 entries, 3c3b0ba31ee229e2"},
        {"PsapRowsTilesPlannedOften", "1674669 tests, 84000 entries, b91596e6497ff094"},
        {"PsapRowsNear", "974427 tests, 84000 entries, ec240324c437f669"},
        {"PsapRowsNearCapacityOne", "1186683 tests, 84000 entries, 54060d2ab8c073a0"},
        {"PsapRowsNearTilesPlannedOften", "1288747 tests, 84000 entries, 834e594bde88ebbd"},
        {"PsapLiteralNear", "1176862 tests, 126144 entries, e17acf7ac959c69b"},
        {"PsapRowsAxisX", "1288879 tests, 84000 entries, e5b60c8c1861647a"},
        {"PsapRowsAxisY", "1296070 tests, 84000 entries, d8aa231e6cbd0966"},
        {"PsapRowsAxisZ", "1350667 tests, 84000 entries, ea07db4b1619df20"},
        {"PsapRowsAxisRandom", "1350667 tests, 84000 entries, ea07db4b1619df20"},
        {"PsapRowsSmallCells", "3476945 tests, 84000 entries, 88423c336348a8a6"},
        {"PsapRowsLargeCells", "61899740 tests, 84000 entries, 667cfad965db8741"},
        {"PsapRowsSmallCellsLongBins", "3476945 tests, 84000 entries, 88423c336348a8a6"},
        {"PsapLiteral", "1738956 tests, 126804 entries, dc91fc6299af28cc"},
        {"PsapLiteralCapacityOne", "1911266 tests, 126804 entries, 71715009a06b2475"},
        {"PsapLiteralThesisCells", "7329871 tests, 83460 entries, 3881a106dff562f2"},
        {"PsapLiteralManyCells", "4005492 tests, 1573074 entries, a7e7e0ce10be2640"},
        {"PsapLiteralAxisX", "1719544 tests, 125789 entries, 16917a868ea0b63e"},
        {"PsapLiteralAxisRandom", "3074702 tests, 126702 entries, b91e171bc436c2ae"},
        {"PsapLiteralPrincipal", "2819100 tests, 134429 entries, 36645f28d4dfadaf"},
        {"PsapLiteralBitStrings", "645990 tests, 126804 entries, 665beaba354179a2"},
        {"PsapLiteralSplitWork", "6992322 tests, 83460 entries, 82ead9cd67332fd6"},
        {"PsapLiteralEverything", "1615638 tests, 115615 entries, c25c3c7a0f1b9948"},
        {"PsapShifted", "1900393 tests, 477249 entries, fa8324ff3db9269b"},
        {"Grid", "6207250 tests, 426118 entries, 3e6cbd49a4d9415f"},
        {"GridCellScaleOne", "4554162 tests, 539814 entries, d9f6ea9b8f9ee3fd"},
        {"GridAlwaysRebuild", "8111736 tests, 430265 entries, 1605d84db9fc2400"},
        {"GridRebuildAtThirty", "6261962 tests, 426076 entries, bff08de31281beb3"},
        {"GridNeverRebuild", "9285539 tests, 402940 entries, 130802a5bba575e2"},
        {"GridNeverSettles", "8110244 tests, 430131 entries, 4ef6a323527cd56a"},
        {"GridOneLevel", "6206910 tests, 426118 entries, 4fa5e4bc5f88b20d"},
        {"GridThreeLevels", "7097466 tests, 643223 entries, e8f868e1844b1e65"},
        {"Flat", "192258483 tests, 318000 entries, 132c5f041c84f819"},
        {"Cells", "1110132 tests, 900540 entries, a91edc00702822e8"},
        {"CellsHalfWidth", "671091 tests, 2435337 entries, 6cf6f5b1c176634e"},
        {"CellsAlwaysRebuild", "1151741 tests, 900540 entries, 8ea8bf5e850744ee"},
        {"CellsNeverRebuild", "1064882 tests, 900540 entries, 4fc319e879808a4f"},
        {"CellsSimpleUpdate", "1064882 tests, 900540 entries, d230219a5940a7f7"},
        {"CellsOwnLevel", "1022766 tests, 570756 entries, bace4788f8a6cfe4"},
        {"CellsOnePoint", "2680081 tests, 83700 entries, 6f0152fdb9e04aca"},
        {"UniformGrid", "12425832 tests, 239943 entries, 11b94eb198b1fdb"},
        {"CellsCountedPairs", "1110132 tests, 900540 entries, 24fb6a9c836c46e3"},
        {"LeGrand", "13543996 tests, 183789 entries, cf0c048cbc69d58f"},
        {"Sap", "1796110 tests, 502380 entries, 876057d883a5f116"},
    };
    return recorded;
}

class BackendWork : public BackendTest
{
};

TEST_P(BackendWork, IsTheRecordedOneInFixedScenes)
{
    const bool isGrid = GetParam().name.rfind("Grid", 0) == 0 || GetParam().name == "Flat";
    WorkRecord record;
    recordTurns(*GetParam().make(), isGrid ? TurningScene::kSteps : 30, record);
    recordLevels(*GetParam().make(), record);
    for (const SceneKind kind : {SceneKind::Uniform, SceneKind::ManySizes, SceneKind::MostlyStatic,
                                 SceneKind::Pile, SceneKind::Teleport})
        recordScene(*GetParam().make(), kind, isGrid ? 24 : 6, record);
    const auto recorded = recordedWork().find(GetParam().name);
    EXPECT_EQ(record.text(), recorded == recordedWork().end() ? "no record" : recorded->second);
}

// Otherwise the records would say nothing of the modes.
TEST(BackendWorkScenes, LeadTheGridThroughAllOfItsModes)
{
    GridOptions options;
    options.threads = 1;
    options.flatLimit = 0;
    const auto grid = makeGridBackend(options);
    TurningScene scene(5);
    std::set<std::string> paths, reasons;
    PairDelta delta;
    for (int step = 0; step < TurningScene::kSteps; ++step)
    {
        ASSERT_EQ(grid->update(scene.table.beginUpdate(scene.margin, true), delta), Status::Ok);
        scene.table.endUpdate();
        paths.insert(grid->stats().path);
        reasons.insert(grid->stats().decision.reason);
        scene.step(step);
    }
    EXPECT_EQ(paths, (std::set<std::string>{"follow", "idle", "incremental", "rebuild", "settle"}));
    EXPECT_GE(reasons.size(), 7u) << testing::PrintToString(reasons);
}

INSTANTIATE_TEST_SUITE_P(Backends, BackendWork, testing::ValuesIn(workCases()), backendCaseName);
}  // namespace
}  // namespace cullet::test
