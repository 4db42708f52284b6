// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/draw_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <string>
#include <vector>

/// What was seen of a scene over time, in single precision and without Bullet: what painters and exporters take.
namespace cullet
{
/// What a body is painted as.
enum class BodyState : std::uint8_t
{
    Hidden,     ///< not in the world (any more, or yet)
    Static,     ///< never moves: ground, walls
    Asleep,     ///< does not move until touched
    Separated,  ///< no other box overlaps its box
    Near,       ///< a box overlaps its box, but nothing touches it
    Touching,   ///< has a contact point without distance
    Ghost       ///< reports what it overlaps and is passed through; painted translucent
};
inline constexpr int kBodyStateCount = 7;

struct StateLook
{
    const char* name;
    Eigen::Vector4f color;  ///< red, green, blue, opacity, as on a screen (sRGB)
};
const StateLook& lookOf(BodyState state);

/// The colours in words, one line.
std::string describeLegend();

struct BodyPose
{
    Eigen::Vector3f position = Eigen::Vector3f::Zero();
    Eigen::Vector3f scale = Eigen::Vector3f::Ones();  ///< of the mesh, before the rotation
    Eigen::Vector4f rotation{0, 0, 0, 1};             ///< quaternion x, y, z, w

    Eigen::Affine3f toMatrix() const;
};

/// What a body looks like from a frame on.
struct BodyChange
{
    std::uint32_t body = 0;  ///< number of the body in the film
    std::uint32_t mesh = 0;
    BodyState state = BodyState::Hidden;
    BodyPose pose;
};

/// A line of a box, a cell or a pair.
struct FilmLine
{
    Eigen::Vector3f from, to;
    Eigen::Vector3f color;
};

struct FilmFrame
{
    double time = 0;                  ///< seconds since the start of the scene
    std::vector<BodyChange> changes;  ///< bodies that look other than in the frame before, ascending
    std::vector<FilmLine> lines;
};

/// What was filmed, as it was at the end.
struct FilmSource
{
    std::string backend;  ///< broad phase
    int threads = 1;
    std::uint64_t pairs = 0;  ///< in the pair cache
    std::uint64_t hash = 0;   ///< of the state of the world; of a recording, of its boxes
};

/// Frames as differences, so that a million bodies that rest take next to nothing.
struct Film
{
    static constexpr std::uint32_t kCube = 0;    ///< mesh 0: a cube with edge 1
    static constexpr std::uint32_t kSphere = 1;  ///< mesh 1: a sphere with radius 1

    Film();

    std::vector<DrawMesh> meshes;
    std::uint32_t bodyCount = 0;
    std::vector<FilmFrame> frames;
    Eigen::Vector3f up = Eigen::Vector3f::UnitY();
    FilmSource source;
};

/// All bodies as they look in one frame, from the first frame on.
class FilmState
{
public:
    explicit FilmState(const Film& film);

    void apply(const FilmFrame& frame);

    /// [Film::bodyCount]; change.body is its own index.
    const std::vector<BodyChange>& bodies() const { return m_bodies; }

private:
    std::vector<BodyChange> m_bodies;
};
}  // namespace cullet
