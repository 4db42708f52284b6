// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>

namespace cullet
{
/// Path of a frame in a folder: frame_00000.png and so on.
std::string framePath(const std::string& folder, std::size_t number);

/// Throws std::invalid_argument unless the file ends in .gif or .mp4, std::runtime_error unless ffmpeg is installed.
void checkAnimation(const std::string& file);

/// Joins the frames of a folder into a GIF or an MP4 by the program ffmpeg.
///
/// @throws std::runtime_error with the message of ffmpeg
void joinFrames(const std::string& folder, double framesPerSecond, const std::string& file);
}  // namespace cullet
