// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>

namespace cullet
{
/// The frames of a folder, frame_00000.png and so on.
std::string framePath(const std::string& folder, std::size_t number);

/// Throws std::invalid_argument unless the file ends in .gif or .mp4, std::runtime_error unless ffmpeg is there.
void checkAnimation(const std::string& file);

/// Joins the frames of a folder into a GIF or an MP4 by the program ffmpeg.
///
/// @throws std::runtime_error with what ffmpeg said
void joinFrames(const std::string& folder, double framesPerSecond, const std::string& file);
}  // namespace cullet
