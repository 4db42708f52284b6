// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/draw_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <string>
#include <vector>

/// A scene over time, in single precision and without Bullet: the input of painters and exporters.
namespace cullet
{
/// State of a body, which determines its colour.
enum class BodyState : std::uint8_t
{
    Hidden,     ///< not in the world (no longer, or not yet)
    Static,     ///< never moves: ground, walls
    Asleep,     ///< at rest until touched
    Separated,  ///< no other box overlaps its box
    Near,       ///< a box overlaps its box, but no body touches it
    Touching,   ///< has a contact point without distance
    Ghost       ///< reports overlaps without response; painted translucent
};
inline constexpr int kBodyStateCount = 7;

struct StateLook
{
    const char* name;
    Eigen::Vector4f color;  ///< red, green, blue, opacity, in sRGB
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

/// New look of a body from a frame on.
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
    std::vector<BodyChange> changes;  ///< bodies whose look differs from the previous frame, ascending
    std::vector<FilmLine> lines;
};

/// The filmed scene, in its final state.
struct FilmSource
{
    std::string backend;  ///< broad phase
    int threads = 1;
    std::uint64_t pairs = 0;  ///< in the pair cache
    std::uint64_t hash = 0;   ///< of the state of the world; of a recording, of its boxes
};

/// Frames as differences, so that resting bodies take almost no memory.
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

/// The looks of all bodies in one frame, by applying the changes from the first frame on.
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
