// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/render/film/scene_film.h"
#include "cullet/demos/render/painter.h"

#include <LinearMath/btSerializer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

// Small pictures of all scenes against stored ones. CULLET_WRITE_GOLDEN=1 in the environment rewrites them; inspect
// them before a commit.
namespace cullet
{
namespace
{
constexpr int kWidth = 136, kHeight = 76;

// Mesa's llvmpipe gives the stored pictures bit by bit, on any number of threads and width of vectors; its softpipe
// differs by a mean of up to 0.8 and in one square by up to 2.1. The tests below check that real differences exceed
// these limits.
constexpr double kMean = 1.2, kLargest = 5;

struct Picture
{
    const char* scene;
    std::uint32_t bodies;
    int steps;  ///< few, so that differences in the last bits of sin and cos do not grow
};

constexpr Picture kPictures[] = {
    {"drop", 120, 45},    {"boxes", 120, 45},    {"hulls", 120, 45},       {"barrels", 90, 20},
    {"hills", 60, 60},    {"thesis", 150, 20},   {"W1", 150, 20},          {"W2", 150, 20},
    {"W3", 150, 20},      {"W4", 300, 20},       {"W5", 150, 3},           {"pour", 60, 60},
    {"pile", 200, 10},    {"wall", 120, 34},     {"domino", 80, 60},       {"cards", 50, 10},
    {"static", 3000, 5},  {"planet", 500, 5},    {"stampede", 12, 30},     {"soft", 12, 30},
    {"crowd", 60, 60},    {"file", 0, 5},        {"robots", 9, 30},        {"compounds", 27, 30},
    {"terrain", 60, 60},  {"free-hulls", 64, 2}, {"convex-mesh", 100, 60}, {"pyramid", 66, 10},
    {"ragdolls", 44, 30}, {"statics", 16, 40},   {"city", 16, 80},         {"needles", 25, 34},
    {"slide", 6, 20},
};

/// Saves a few bricks of the scene "wall" as Bullet does, for the scene "file".
std::string saveWall()
{
    WorldSceneOptions options;
    options.bodies = 40;
    options.threads = 1;
    const std::unique_ptr<WorldScene> wall = makeWorldScene("wall", options);
    for (int step = 0; step < 45; ++step)
        wall->step();
    btDefaultSerializer serializer;
    wall->world().serialize(&serializer);
    const std::string path = testing::TempDir() + "cullet_golden.bullet";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(serializer.getBufferPointer()),
               serializer.getCurrentBufferSize());
    return path;
}

Film filmOf(const Picture& picture)
{
    SceneFilmOptions options;
    options.scene = picture.scene;
    options.world.bodies = picture.bodies;
    options.world.threads = 1;
    options.steps = picture.steps;
    options.every = 2;
    if (options.scene == "file")
        options.world.file = saveWall();
    const Film film = filmScene(options, [](int) { return true; });
    if (!options.world.file.empty())
        std::filesystem::remove(options.world.file);
    return film;
}

/// The last frame.
Image paintLast(const Film& film)
{
    FilmState state(film);
    for (const FilmFrame& frame : film.frames)
        state.apply(frame);
    Painter painter(film, kWidth, kHeight);
    return painter.paint(film.frames.back(), state,
                         aimCameras(film, {}, static_cast<float>(kWidth) / kHeight).back());
}

class RenderGolden : public testing::TestWithParam<Picture>
{
};
}  // namespace

TEST_P(RenderGolden, MatchesStoredPictureInLastFrame)
{
    if (!hasPainter())
        GTEST_SKIP() << "built without a renderer (libosmesa6-dev, libpng-dev)";
    Image image;
    try
    {
        image = paintLast(filmOf(GetParam()));
    }
    catch (const ProgramError& error)
    {
        if (error.code() == kExitUnavailable)
            GTEST_SKIP() << error.what();
        throw;
    }
    const std::string stored = std::string(CULLET_GOLDEN_FOLDER) + "/" + GetParam().scene + ".png";
    if (std::getenv("CULLET_WRITE_GOLDEN") != nullptr)
        writePng(image, stored);
    const ImageDifference difference = compareImages(image, readPng(stored));
    RecordProperty("difference", std::to_string(difference.mean) + " " + std::to_string(difference.largest));
    const std::string seen =
        std::filesystem::temp_directory_path() / (std::string(GetParam().scene) + ".png");
    if (difference.mean > kMean || difference.largest > kLargest)
    {
        writePng(image, seen);
        ADD_FAILURE() << "mean difference " << difference.mean << ", largest in a square "
                      << difference.largest << "; stored: " << stored << ", seen: " << seen;
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, RenderGolden, testing::ValuesIn(kPictures),
                         [](const auto& test)
                         {
                             // Names of tests have no hyphen.
                             std::string name = test.param.scene;
                             std::replace(name.begin(), name.end(), '-', '_');
                             return name;
                         });

TEST(Render, HasStoredPictureOfEveryScene)
{
    for (const WorldSceneInfo& scene : worldScenes())
    {
        const bool isThere =
            std::any_of(std::begin(kPictures), std::end(kPictures),
                        [&](const Picture& picture) { return std::string(picture.scene) == scene.name; });
        EXPECT_TRUE(isThere) << scene.name << " is to be added to kPictures";
    }
}

TEST(Render, RepeatsPictureAndShowsMovedBodyAndChangedColour)
{
    if (!hasPainter())
        GTEST_SKIP() << "built without a renderer (libosmesa6-dev, libpng-dev)";
    const Film film = filmOf({"boxes", 120, 45});
    const Image image = paintLast(film);
    EXPECT_EQ(image.pixels, paintLast(film).pixels) << "the same film twice";

    // One of 120 bodies, which is visible.
    const std::uint32_t body = film.bodyCount - 1;
    Film moved = film;
    BodyChange& last = moved.frames.back().changes.back();
    ASSERT_EQ(last.body, body);
    last.pose.position.x() += 0.7f;
    const ImageDifference motion = compareImages(image, paintLast(moved));
    EXPECT_GT(motion.largest, 2 * kLargest);

    Film coloured = film;
    BodyState& state = coloured.frames.back().changes.back().state;
    state = state == BodyState::Touching ? BodyState::Near : BodyState::Touching;
    const ImageDifference colour = compareImages(image, paintLast(coloured));
    EXPECT_GT(colour.largest, 2 * kLargest);
    RecordProperty("motion", std::to_string(motion.largest));
    RecordProperty("colour", std::to_string(colour.largest));
}

TEST(Render, ComparesPicturesByMeanAndWorstSquare)
{
    Image black{16, 16, std::vector<std::uint8_t>(16 * 16 * 3)}, other = black;
    for (int y = 0; y < 8; ++y)
    {
        for (int x = 0; x < 24; ++x)
            other.pixels[static_cast<std::size_t>(48 * y + x)] = 100;
    }
    const ImageDifference difference = compareImages(black, other);
    EXPECT_NEAR(difference.mean, 25, 1e-9);
    EXPECT_NEAR(difference.largest, 100, 1e-9);
    EXPECT_THROW(compareImages(black, shrink(black, 2)), std::invalid_argument);
    EXPECT_EQ(shrink(other, 8).pixels, (std::vector<std::uint8_t>{100, 100, 100, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
}
}  // namespace cullet
