// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/film/animation.h"

#include "cullet/demos/program/system.h"

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace cullet
{
namespace
{
bool endsIn(const std::string& file, const std::string& ending)
{
    return file.size() > ending.size() &&
           file.compare(file.size() - ending.size(), ending.size(), ending) == 0;
}
}  // namespace

std::string framePath(const std::string& folder, std::size_t number)
{
    char name[32];
    std::snprintf(name, sizeof name, "frame_%05zu.png", number);
    return (std::filesystem::path(folder) / name).string();
}

void checkAnimation(const std::string& file)
{
    if (!endsIn(file, ".gif") && !endsIn(file, ".mp4"))
        throw std::invalid_argument("--animate takes a file that ends in .gif or .mp4, not " + file);
    if (runProgram({"ffmpeg", "-version"}, ChildOutput::Discarded) != 0)
        throw std::runtime_error(
            "--animate needs the program ffmpeg (package ffmpeg); --out DIR writes the frames alone");
}

void joinFrames(const std::string& folder, double framesPerSecond, const std::string& file)
{
    std::vector<std::string> words = {
        "ffmpeg",     "-y",
        "-v",         "error",
        "-framerate", std::to_string(framesPerSecond),
        "-i",         (std::filesystem::path(folder) / "frame_%05d.png").string()};
    if (endsIn(file, ".gif"))
        // One palette for all frames, and only the changes of each frame.
        words.insert(words.end(), {"-filter_complex",
                                   "[0:v]split[a][b];[a]palettegen=max_colors=128:stats_mode=full[p];"
                                   "[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle"});
    else
        // Players require even sizes and this pixel format.
        words.insert(words.end(), {"-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-c:v", "libx264", "-pix_fmt",
                                   "yuv420p", "-crf", "20", "-movflags", "+faststart"});
    words.push_back(file);
    const int code = runProgram(words, ChildOutput::Discarded);
    if (code != 0)
        throw std::runtime_error("ffmpeg could not write " + file + " (exit code " + std::to_string(code) +
                                 ")");
}
}  // namespace cullet
