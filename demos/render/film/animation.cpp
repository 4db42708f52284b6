// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/film/animation.h"

#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace cullet
{
namespace
{
/// Runs a program and discards its output; returns its exit code, or 127 if it cannot be started.
int runQuietly(std::vector<std::string> words)
{
    std::vector<char*> arguments;
    for (std::string& word : words)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int failure = posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    int status = 0;
    if (failure != 0 || waitpid(child, &status, 0) != child)
        return 127;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

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
    if (runQuietly({"ffmpeg", "-version"}) != 0)
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
    const int code = runQuietly(words);
    if (code != 0)
        throw std::runtime_error("ffmpeg could not write " + file + " (exit code " + std::to_string(code) +
                                 ")");
}
}  // namespace cullet
