// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/camera.h"
#include "cullet/demos/render/film/film.h"
#include "cullet/demos/render/image/image.h"

#include <memory>

namespace cullet
{
/// Draws frames of a film without a display, by Mesa's software renderer (OSMesa).
///
/// Lit by a sun with shadows and a sky; floors show a grid of lines whose spacing is a power of ten or its half. Static
/// boxes between the eye and the framed bodies are painted nearly transparent. Edges are antialiased: each pixel is the
/// mean of 9 samples. A film gives the same picture in every run; processors and versions of Mesa differ in the last
/// bits.
///
/// Cost: about 0.15 s of one core for 480 x 270 pixels, and half a microsecond per triangle.
class Painter
{
public:
    static constexpr int kMaxPixels = 4096;  ///< width and height of a picture

    /// @param film must outlive the painter
    /// @throws std::runtime_error if this build has no renderer, or it does not start
    Painter(const Film& film, int width, int height);
    ~Painter();
    Painter(const Painter&) = delete;
    Painter& operator=(const Painter&) = delete;

    /// @param frame of the film, with the bodies of `state`
    Image paint(const FilmFrame& frame, const FilmState& state, const Camera& camera);

private:
    struct Parts;
    std::unique_ptr<Parts> m;
};

/// Whether this build has a renderer.
bool hasPainter();

/// Paints all frames of a film; calls take(image, number of the frame).
template <class Take>
void paintFilm(const Film& film, int width, int height, const CameraOptions& cameraOptions, Take take)
{
    const std::vector<Camera> cameras =
        aimCameras(film, cameraOptions, static_cast<float>(width) / static_cast<float>(height));
    Painter painter(film, width, height);
    FilmState state(film);
    for (std::size_t number = 0; number < film.frames.size(); ++number)
    {
        state.apply(film.frames[number]);
        take(painter.paint(film.frames[number], state, cameras[number]), number);
    }
}
}  // namespace cullet
