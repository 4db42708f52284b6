// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/camera.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace cullet
{
namespace
{
struct Ball
{
    Eigen::Vector3f centre;
    float radius;
};

float radiusOf(const DrawMesh& mesh)
{
    float squared = 0;
    for (const Eigen::Vector3f& position : mesh.positions)
        squared = std::max(squared, position.squaredNorm());
    return std::sqrt(squared);
}

/// Positions of the bodies to frame, at most some hundred thousand.
class Subjects
{
public:
    explicit Subjects(const Film& film) : m_film(film)
    {
        for (const DrawMesh& mesh : film.meshes)
            m_radii.push_back(radiusOf(mesh));
        findMovers();
        for (int rank = kMoving; rank >= kFixture && balls.empty(); --rank)
            collect(rank);
    }

    std::vector<Ball> balls;

private:
    enum Rank : std::uint8_t
    {
        kFixture,
        kResting,
        kMoving
    };

    void findMovers()
    {
        m_ranks.assign(m_film.bodyCount, kFixture);
        FilmState state(m_film);
        for (const FilmFrame& frame : m_film.frames)
        {
            for (const BodyChange& change : frame.changes)
            {
                const BodyChange& before = state.bodies()[change.body];
                if (change.state == BodyState::Hidden || change.state == BodyState::Static)
                    continue;
                const bool moves =
                    before.state != BodyState::Hidden && before.pose.position != change.pose.position;
                m_ranks[change.body] =
                    std::max<std::uint8_t>(m_ranks[change.body], moves ? kMoving : kResting);
            }
            state.apply(frame);
        }
    }

    void collect(int rank)
    {
        constexpr std::size_t kMaxSamples = 400000;
        std::size_t changes = 0;
        for (const FilmFrame& frame : m_film.frames)
            changes += frame.changes.size();
        const std::size_t stride = 1 + changes / kMaxSamples;
        std::size_t number = 0;
        for (const FilmFrame& frame : m_film.frames)
        {
            for (const BodyChange& change : frame.changes)
            {
                if (m_ranks[change.body] == rank && change.state != BodyState::Hidden &&
                    number++ % stride == 0)
                    balls.push_back(
                        {change.pose.position, m_radii[change.mesh] * change.pose.scale.maxCoeff()});
            }
        }
    }

    const Film& m_film;
    std::vector<float> m_radii;
    std::vector<std::uint8_t> m_ranks;
};

/// The value that a share of the values does not exceed.
float quantile(std::vector<float> values, double share)
{
    const auto place =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

constexpr double kTrim = 0.005;

Ball boundsOf(const std::vector<Ball>& balls)
{
    if (balls.empty())
        return {Eigen::Vector3f::Zero(), 1};
    Ball bounds{Eigen::Vector3f::Zero(), 0};
    Eigen::Vector3f half;
    for (int axis = 0; axis < 3; ++axis)
    {
        std::vector<float> low, high;
        for (const Ball& ball : balls)
        {
            low.push_back(ball.centre[axis] - ball.radius);
            high.push_back(ball.centre[axis] + ball.radius);
        }
        const float min = quantile(low, kTrim), max = quantile(high, 1 - kTrim);
        bounds.centre[axis] = (min + max) / 2;
        half[axis] = (max - min) / 2;
    }
    bounds.radius = std::max(half.norm(), 1e-6f);
    return bounds;
}

/// Unit vector from the target to the eye.
Eigen::Vector3f directionTo(const Eigen::Vector3f& up, float yawDegrees, float pitchDegrees)
{
    constexpr float kDegree = 0.017453293f;
    int axis = 0;
    up.cwiseAbs().minCoeff(&axis);
    // With y up, yaw 0 looks from +z.
    const int forward = up.cwiseAbs().maxCoeff() == std::abs(up.y()) ? 2 : axis;
    const Eigen::Vector3f side = up.cross(Eigen::Vector3f::Unit(forward)).normalized();
    const Eigen::Vector3f front = side.cross(up);
    const float yaw = yawDegrees * kDegree, pitch = pitchDegrees * kDegree;
    return std::cos(pitch) * (std::cos(yaw) * front + std::sin(yaw) * side) + std::sin(pitch) * up;
}

/// Distance of the eye at which the balls are in the picture.
float distanceFor(const std::vector<Ball>& balls, const Camera& camera, const Eigen::Vector3f& toEye,
                  float aspect)
{
    const float high = std::tan(camera.fieldOfView / 2), wide = high * aspect;
    const Eigen::Vector3f right = camera.up.cross(toEye).normalized(), above = toEye.cross(right);
    std::vector<float> distances = {1.2f * camera.radius};
    for (const Ball& ball : balls)
    {
        const Eigen::Vector3f place = ball.centre - camera.target;
        const float flat = std::max((std::abs(place.dot(right)) + ball.radius) / wide,
                                    (std::abs(place.dot(above)) + ball.radius) / high);
        distances.push_back(place.dot(toEye) + flat);
    }
    return quantile(distances, 1 - kTrim);
}
}  // namespace

CameraOptions parseCamera(const std::vector<float>& numbers)
{
    CameraOptions cameraOptions;
    if (!std::all_of(numbers.begin(), numbers.end(), [](float number) { return std::isfinite(number); }))
        throw std::invalid_argument("--camera takes finite numbers");
    if (numbers.size() == 6)
    {
        cameraOptions.fixed = numbers;
        return cameraOptions;
    }
    if (numbers.size() != 2 && numbers.size() != 3)
        throw std::invalid_argument("--camera takes YAW,PITCH[,ZOOM] or six numbers, the eye and the target");
    cameraOptions.yaw = numbers[0];
    cameraOptions.pitch = numbers[1];
    cameraOptions.zoom = numbers.size() == 3 ? numbers[2] : 1;
    if (!(std::abs(cameraOptions.pitch) < 90) || !(cameraOptions.zoom > 0))
        throw std::invalid_argument("--camera: the pitch is below 90 degrees and the zoom above 0");
    return cameraOptions;
}

std::vector<Camera> aimCameras(const Film& film, const CameraOptions& cameraOptions, float aspect)
{
    const std::vector<Ball> balls = Subjects(film).balls;
    const Ball bounds = boundsOf(balls);
    Camera camera{bounds.centre, bounds.centre, film.up, 0.6f, bounds.radius};
    std::vector<Camera> cameras;
    if (!cameraOptions.fixed.empty())
    {
        camera.eye = {cameraOptions.fixed[0], cameraOptions.fixed[1], cameraOptions.fixed[2]};
        camera.target = {cameraOptions.fixed[3], cameraOptions.fixed[4], cameraOptions.fixed[5]};
        return std::vector<Camera>(film.frames.size(), camera);
    }
    float distance = 0;
    for (std::size_t frame = 0; frame < film.frames.size(); ++frame)
    {
        const float share = static_cast<float>(frame) / static_cast<float>(film.frames.size());
        const Eigen::Vector3f toEye =
            directionTo(film.up, cameraOptions.yaw + cameraOptions.orbit * share, cameraOptions.pitch);
        // An orbit at a constant distance: that of the first frame and an allowance.
        if (frame == 0)
            distance = distanceFor(balls, camera, toEye, aspect) *
                       (cameraOptions.orbit == 0 ? 1.04f : 1.15f) / cameraOptions.zoom;
        camera.eye = camera.target + distance * toEye;
        cameras.push_back(camera);
    }
    return cameras;
}
}  // namespace cullet
