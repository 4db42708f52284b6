// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/view_math.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
Eigen::Matrix4f lookAt(const Eigen::Vector3f& eye, const Eigen::Vector3f& target, const Eigen::Vector3f& up)
{
    const Eigen::Vector3f back = (eye - target).normalized();
    const Eigen::Vector3f right = up.cross(back).normalized();
    Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
    matrix.block<1, 3>(0, 0) = right.transpose();
    matrix.block<1, 3>(1, 0) = back.cross(right).transpose();
    matrix.block<1, 3>(2, 0) = back.transpose();
    matrix.block<3, 1>(0, 3) = -matrix.block<3, 3>(0, 0) * eye;
    return matrix;
}

Eigen::Matrix4f perspective(float fieldOfView, float aspect, float near, float far)
{
    const float f = 1 / std::tan(fieldOfView / 2);
    Eigen::Matrix4f matrix = Eigen::Matrix4f::Zero();
    matrix(0, 0) = f / aspect;
    matrix(1, 1) = f;
    matrix(2, 2) = (far + near) / (near - far);
    matrix(2, 3) = 2 * far * near / (near - far);
    matrix(3, 2) = -1;
    return matrix;
}

/// Whether a segment intersects the cube of a pose.
bool meetsCube(const BodyPose& pose, const Eigen::Vector3f& from, const Eigen::Vector3f& to)
{
    const Eigen::Matrix3f back = Eigen::Quaternionf(pose.rotation).conjugate().toRotationMatrix();
    const Eigen::Vector3f start = back * (from - pose.position), way = back * (to - from);
    float enter = 0, leave = 1;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float half = pose.scale[axis] / 2;
        const float a = (-half - start[axis]) / way[axis], b = (half - start[axis]) / way[axis];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
    }
    return enter < leave;
}

}  // namespace

void spanHorizon(const Eigen::Vector3f& up, Eigen::Vector3f& u, Eigen::Vector3f& v)
{
    int axis = 0;
    up.cwiseAbs().minCoeff(&axis);
    u = up.cross(Eigen::Vector3f::Unit(axis)).normalized();
    v = up.cross(u);
}

Eigen::Vector3f sunDirection(const Eigen::Vector3f& up)
{
    Eigen::Vector3f u, v;
    spanHorizon(up, u, v);
    return (up - 0.5f * u + 0.4f * v).normalized();
}

Eigen::Matrix4f shadowMatrix(const Camera& camera)
{
    Eigen::Matrix4f flat = Eigen::Matrix4f::Identity();
    flat(0, 0) = flat(1, 1) = 1 / (kShadowReach * camera.radius);
    flat(2, 2) = -1 / (8 * camera.radius);
    Eigen::Vector3f u, v;
    spanHorizon(camera.up, u, v);
    return flat * lookAt(camera.target + sunDirection(camera.up) * camera.radius, camera.target, u);
}

Eigen::Matrix4f screenMatrix(const Camera& camera, float aspect)
{
    const float distance = (camera.eye - camera.target).norm();
    const float near = std::max(distance - 4 * camera.radius, 0.02f * distance);
    return perspective(camera.fieldOfView, aspect, near, distance + 40 * camera.radius) *
           lookAt(camera.eye, camera.target, camera.up);
}

bool isInTheWay(const BodyPose& cube, const Camera& camera)
{
    const Eigen::Vector3f toEye = (camera.eye - camera.target).normalized();
    const Eigen::Vector3f right = camera.up.cross(toEye).normalized(), above = toEye.cross(right);
    for (const float x : {-0.45f, 0.0f, 0.45f})
    {
        for (const float y : {-0.1f, 0.35f})
        {
            if (meetsCube(cube, camera.eye, camera.target + camera.radius * (x * right + y * above)))
                return true;
        }
    }
    return false;
}

bool isWall(const BodyPose& cube, const Camera& camera)
{
    const Eigen::Vector3f up = Eigen::Quaternionf(cube.rotation).conjugate() * camera.up;
    return up.cwiseAbs().dot(cube.scale) > 0.8f * camera.radius && cube.scale.maxCoeff() > camera.radius;
}

float gridStepFor(float radius)
{
    const float power = std::pow(10.0f, std::floor(std::log10(radius / 2)));
    return radius / 2 >= 5 * power ? power : power / 2;
}
}  // namespace cullet
