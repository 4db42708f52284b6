// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/film.h"

#include <Eigen/Core>

#include <vector>

namespace cullet
{
/// Where the picture is taken from.
struct Camera
{
    Eigen::Vector3f eye;
    Eigen::Vector3f target;
    Eigen::Vector3f up;        ///< unit length
    float fieldOfView = 0.6f;  ///< radians, vertical
    float radius = 1;  ///< of the sphere around `target` that holds what is framed, length unit of the scene
};

/// Where an automatic camera stands.
struct CameraWish
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
CameraWish parseCamera(const std::vector<float>& numbers);

/// Cameras that show the bodies that move in a film, or all if none does, from start to end: one for each frame.
///
/// Of the places of bodies, 1 in 100 may lie outside, so that one body that flies away does not spoil the picture.
/// @param aspect width / height
std::vector<Camera> aimCameras(const Film& film, const CameraWish& wish, float aspect);
}  // namespace cullet
