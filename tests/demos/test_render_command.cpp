// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/render/film/animation.h"
#include "cullet/demos/render/painter.h"
#include "cullet/tests/demos/program.h"

#include <filesystem>

namespace cullet
{
namespace
{
/// A folder that is deleted after the test.
struct Folder
{
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return path + "/" + name; }
    std::string path = temporaryPath("render");
};

const std::string kSmall = "render --scene boxes --bodies 20 --quiet --size 64x36 ";

bool hasFfmpeg()
{
    return runShell("ffmpeg -version").code == 0;
}

/// Number of frames of a GIF, by its graphic control extensions.
std::size_t gifFrames(const std::string& bytes)
{
    std::size_t count = 0;
    for (std::size_t at = 0; (at = bytes.find("\x21\xF9\x04", at)) != std::string::npos; ++at)
        ++count;
    return count;
}
}  // namespace

TEST(RenderCommand, WritesAPictureForEachFrameInWhichBodiesFall)
{
    if (!hasPainter())
        GTEST_SKIP() << "built without a renderer (libosmesa6-dev, libpng-dev)";
    const Folder folder;
    const Outcome outcome = runProgram(kSmall + "--steps 50 --every 20 --out " + folder.path);
    ASSERT_EQ(outcome.code, kExitOk) << outcome.errors;
    EXPECT_TRUE(contains(outcome.output, "3 frames")) << outcome.output;
    EXPECT_TRUE(contains(outcome.output, "touching red")) << "the legend";
    EXPECT_TRUE(contains(outcome.output, "commit "));
    for (std::size_t frame = 0; frame < 3; ++frame)
    {
        const Image image = readPng(framePath(folder.path, frame));
        EXPECT_EQ(image.width, 64);
        EXPECT_EQ(image.height, 36);
    }
    EXPECT_FALSE(std::filesystem::exists(framePath(folder.path, 3)));
    const ImageDifference motion =
        compareImages(readPng(framePath(folder.path, 0)), readPng(framePath(folder.path, 2)));
    EXPECT_GT(motion.mean, 1);
}

TEST(RenderCommand, LeavesNoFramesOfAnEarlierFilm)
{
    if (!hasPainter())
        GTEST_SKIP() << "built without a renderer (libosmesa6-dev, libpng-dev)";
    const Folder folder;
    for (const int steps : {6, 2})
    {
        const Outcome outcome =
            runProgram(kSmall + "--every 1 --steps " + std::to_string(steps) + " --out " + folder.path);
        ASSERT_EQ(outcome.code, kExitOk) << outcome.errors;
        for (std::size_t frame = 0; frame < 9; ++frame)
            EXPECT_EQ(std::filesystem::exists(framePath(folder.path, frame)),
                      frame <= static_cast<std::size_t>(steps));
    }
}

TEST(RenderCommand, ChangesPictureWithOverlays)
{
    if (!hasPainter())
        GTEST_SKIP() << "built without a renderer (libosmesa6-dev, libpng-dev)";
    const Folder folder;
    for (const std::string overlay : {"", "boxes", "pairs"})
    {
        const std::string option = overlay.empty() ? "" : " --" + overlay;
        ASSERT_EQ(
            runProgram(kSmall + "--steps 20 --start 20" + option + " --out " + folder.file("x" + overlay))
                .code,
            0);
    }
    const auto picture = [&](const std::string& name)
    { return readPng(framePath(folder.file("x" + name), 0)); };
    EXPECT_GT(compareImages(picture(""), picture("boxes")).largest, 10);
    EXPECT_GT(compareImages(picture(""), picture("pairs")).largest, 10);
}

TEST(RenderCommand, JoinsFramesToAnAnimationWhereFfmpegIs)
{
    if (!hasPainter() || !hasFfmpeg())
        GTEST_SKIP() << "needs a renderer (libosmesa6-dev, libpng-dev) and ffmpeg";
    const Folder folder;
    std::filesystem::create_directories(folder.path);
    const Outcome outcome = runProgram(kSmall + "--steps 6 --every 2 --animate " + folder.file("a.gif"));
    ASSERT_EQ(outcome.code, kExitOk) << outcome.errors;
    const std::string gif = readText(folder.file("a.gif"));
    ASSERT_GT(gif.size(), 10u);
    EXPECT_EQ(gif.substr(0, 6), "GIF89a");
    EXPECT_EQ(static_cast<unsigned char>(gif[6]), 64);
    EXPECT_EQ(static_cast<unsigned char>(gif[8]), 36);
    EXPECT_EQ(gifFrames(gif), 4u);
}

TEST(RenderCommand, SaysThatFfmpegIsMissingBeforeAnyWork)
{
    if (!hasPainter())
        GTEST_SKIP() << "built without a renderer (libosmesa6-dev, libpng-dev)";
    const Outcome outcome =
        runShell("PATH=/nowhere " + std::string(CULLET_PROGRAM) + " " + kSmall + "--animate a.gif");
    EXPECT_EQ(outcome.code, kExitUnavailable);
    EXPECT_TRUE(contains(outcome.errors, "ffmpeg")) << outcome.errors;
    EXPECT_FALSE(std::filesystem::exists("a.gif"));
}

TEST(RenderCommand, ShowsBoxesOfRecordingAndNamesBrokenOne)
{
    const Folder folder;
    std::filesystem::create_directories(folder.path);
    const std::string recording = folder.file("a.cbx");
    const Outcome recorded =
        runProgram("record --quiet --scene boxes --bodies 20 --steps 30 --out " + recording);
    ASSERT_EQ(recorded.code, kExitOk) << recorded.errors;
    const Outcome outcome =
        runProgram("render --quiet --every 10 --recording " + recording + " --gltf " + folder.file("a.gltf"));
    ASSERT_EQ(outcome.code, kExitOk) << outcome.errors;
    EXPECT_TRUE(contains(outcome.output, "25 bodies"))
        << "20 boxes, the floor and four walls: " << outcome.output;
    const auto gltf = nlohmann::json::parse(readText(folder.file("a.gltf")));
    EXPECT_EQ(gltf["nodes"].size(), 25u);
    std::size_t still = 0, moving = 0;
    for (const auto& node : gltf["nodes"])
    {
        const auto& mesh = gltf["meshes"].at(node["mesh"].get<std::size_t>());
        still += gltf["materials"].at(mesh["primitives"][0]["material"].get<std::size_t>())["name"] ==
                         "static grey"
                     ? 1
                     : 0;
    }
    EXPECT_EQ(still, 5u);
    for (const auto& channel : gltf["animations"][0]["channels"])
        moving += channel["target"]["path"] == "translation" ? 1 : 0;
    EXPECT_EQ(moving, 20u);

    std::filesystem::resize_file(recording, std::filesystem::file_size(recording) - 3);
    const Outcome broken =
        runProgram("render --quiet --recording " + recording + " --gltf " + folder.file("a.gltf"));
    EXPECT_EQ(broken.code, kExitInput);
    EXPECT_TRUE(contains(broken.errors, recording)) << broken.errors;
}

TEST(RenderCommand, ExportsWorldOfRunCommandWithoutRenderer)
{
    const Folder folder;
    std::filesystem::create_directories(folder.path);
    Outcome outcome;
    const nlohmann::json document =
        runForJson(kSmall + "--steps 10 --backend grid --gltf " + folder.file("a.gltf"), &outcome);
    ASSERT_EQ(outcome.code, kExitOk) << outcome.errors;
    const nlohmann::json& row = document["rows"].at(0);
    EXPECT_EQ(row["frames"], 6);
    EXPECT_EQ(row["bodies"], 25) << "with the floor and four walls";
    const nlohmann::json run =
        runForJson("run --check 0 --parts broadphase --scene boxes --bodies 20 --steps 10 --backend grid");
    EXPECT_EQ(row["hash"], run["rows"].at(0)["hash"]);
    EXPECT_EQ(row["pairs"], run["rows"].at(0)["pairs"]);
    const auto gltf = nlohmann::json::parse(readText(folder.file("a.gltf")));
    EXPECT_EQ(gltf["buffers"][0]["uri"], "a.bin");
    EXPECT_EQ(gltf["buffers"][0]["byteLength"], std::filesystem::file_size(folder.file("a.bin")));
    EXPECT_GE(gltf["nodes"].size(), 20u);
    EXPECT_GE(gltf["animations"][0]["channels"].size(), 20u) << "all bodies fall";
}

TEST(RenderCommand, TracesEveryPhaseOfEveryStep)
{
    const Folder folder;
    std::filesystem::create_directories(folder.path);
    const Outcome outcome = runProgram(kSmall + "--steps 6 --backend grid --gltf " + folder.file("a.gltf") +
                                       " --trace " + folder.file("trace.json"));
    ASSERT_EQ(outcome.code, kExitOk) << outcome.errors;
    std::map<std::string, int> counts =
        countSpans(nlohmann::json::parse(readText(folder.file("trace.json")), nullptr, false));
    EXPECT_EQ(counts["grid"], 1);
    for (const char* name : {"step 1", "calculateOverlappingPairs 1", "solveConstraints 1"})
        EXPECT_EQ(counts[name], 6) << name;
}

TEST(RenderCommand, RefusesWrongArgumentsWithReason)
{
    const auto refuses = [](const std::string& arguments, int code, const std::string& word)
    {
        const Outcome outcome = runProgram("render --quiet " + arguments);
        EXPECT_EQ(outcome.code, code) << arguments;
        EXPECT_TRUE(contains(outcome.errors, word)) << arguments << ": " << outcome.errors;
    };
    refuses("", kExitUsage, "--animate");
    refuses("--scene nosuch --out x", kExitUsage, "W1");
    refuses("--size 64 --out x", kExitUsage, "WIDTHxHEIGHT");
    refuses("--size 64x99999 --out x", kExitUsage, "4096");
    refuses("--camera 1 --out x", kExitUsage, "YAW,PITCH");
    refuses("--animate x.avi", kExitUsage, ".mp4");
    refuses("--gltf x.obj", kExitUsage, ".gltf");
    refuses("--gltf /nowhere/x.gltf --bodies 100000 --steps 1000000", kExitOutput, "/nowhere/x.gltf");
    if (hasPainter() && hasFfmpeg())
        refuses("--animate /nowhere/x.gif --bodies 100000 --steps 1000000", kExitOutput, "/nowhere/x.gif");
    if (hasPainter())
        refuses("--out /proc/x", kExitOutput, "/proc/x");
    else
        refuses("--out x", kExitUnavailable, "libosmesa6-dev");
}
}  // namespace cullet
