// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/film.h"

#include <Eigen/Core>

#include <vector>

namespace cullet
{
/// Position and view of a camera.
struct Camera
{
    Eigen::Vector3f eye;
    Eigen::Vector3f target;
    Eigen::Vector3f up;        ///< unit length
    float fieldOfView = 0.6f;  ///< radians, vertical
    float radius = 1;          ///< of the framed sphere around `target`, length unit of the scene
};

/// Parameters of an automatic camera.
struct CameraOptions
{
    float yaw = 32;            ///< degrees around the up axis
    float pitch = 20;          ///< degrees above the horizon, below 90
    float zoom = 1;            ///< 2: half as far away
    float orbit = 0;           ///< degrees by which the yaw grows over the whole film
    std::vector<float> fixed;  ///< eye and target, six numbers; empty: automatic
};

/// Numbers after `--camera`: YAW,PITCH[,ZOOM] or EYE,TARGET.
///
/// @throws std::invalid_argument
CameraOptions parseCamera(const std::vector<float>& numbers);

/// Cameras, one for each frame, that show the bodies that move in a film, or all bodies if none moves.
///
/// 1 in 100 positions of bodies may lie outside, so that a body that flies away does not spoil the picture.
/// @param aspect width / height
std::vector<Camera> aimCameras(const Film& film, const CameraOptions& cameraOptions, float aspect);
}  // namespace cullet
