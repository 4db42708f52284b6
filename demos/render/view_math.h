// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/camera.h"

#include <Eigen/Core>

// Matrices are those of OpenGL: right-handed, depth from -1 to 1.
namespace cullet
{
/// Transforms from the scene to the picture.
Eigen::Matrix4f screenMatrix(const Camera& camera, float aspect);

/// Transforms from the scene to the sun's view of a square of 2 * kShadowReach radii around the framed sphere.
Eigen::Matrix4f shadowMatrix(const Camera& camera);
inline constexpr float kShadowReach = 1.5f;

/// Two directions that span the horizon.
void spanHorizon(const Eigen::Vector3f& up, Eigen::Vector3f& u, Eigen::Vector3f& v);

/// A unit vector towards the sun.
Eigen::Vector3f sunDirection(const Eigen::Vector3f& up);

/// Whether the cube of a pose occludes the camera's target.
bool isInTheWay(const BodyPose& cube, const Camera& camera);

/// Whether the cube of a pose is a wall around the framed bodies: wide and high.
bool isWall(const BodyPose& cube, const Camera& camera);

/// Distance of the lines on a floor: a power of ten, or its half, of about a tenth of the radius.
float gridStepFor(float radius);
}  // namespace cullet
