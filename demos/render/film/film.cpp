// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/film/film.h"

#include <cstdio>

namespace cullet
{
namespace
{
Eigen::Vector4f rgb(int red, int green, int blue, float opacity = 1)
{
    return {static_cast<float>(red) / 255, static_cast<float>(green) / 255, static_cast<float>(blue) / 255,
            opacity};
}
}  // namespace

const StateLook& lookOf(BodyState state)
{
    static const StateLook looks[kBodyStateCount] = {{"hidden", rgb(0, 0, 0, 0)},
                                                     {"static grey", rgb(214, 216, 221)},
                                                     {"asleep slate", rgb(96, 112, 140)},
                                                     {"separated blue", rgb(74, 158, 222)},
                                                     {"near yellow", rgb(246, 196, 68)},
                                                     {"touching red", rgb(232, 92, 64)},
                                                     {"ghost green", rgb(80, 190, 140, 0.35f)}};
    return looks[static_cast<int>(state)];
}

std::string describeLegend()
{
    std::string text;
    for (int state = static_cast<int>(BodyState::Static); state < kBodyStateCount; ++state)
        text += std::string(text.empty() ? "" : ", ") + lookOf(static_cast<BodyState>(state)).name;
    return text;
}

Eigen::Affine3f BodyPose::toMatrix() const
{
    return Eigen::Translation3f(position) * Eigen::Quaternionf(rotation) * Eigen::Scaling(scale);
}

Film::Film()
{
    meshes.push_back(makeCubeMesh());
    meshes.push_back(makeRevolvedMesh(capsuleOutline(1, 0, 16), 1, 32));
}

FilmState::FilmState(const Film& film) : m_bodies(film.bodyCount)
{
    for (std::uint32_t body = 0; body < film.bodyCount; ++body)
        m_bodies[body].body = body;
}

void FilmState::apply(const FilmFrame& frame)
{
    for (const BodyChange& change : frame.changes)
        m_bodies[change.body] = change;
}
}  // namespace cullet
