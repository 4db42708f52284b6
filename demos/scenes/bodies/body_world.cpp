// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/body_world.h"

#include "cullet/demos/scenes/splitmix64.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr btScalar kSpacing = btScalar(1.3);
constexpr std::uint32_t kLayers = 16;

/// Bodies along each side of a square layer, for a column of at most kLayers layers.
std::uint32_t columnsFor(std::uint32_t bodies)
{
    const double layers =
        std::clamp(std::cbrt(static_cast<double>(bodies)), 1.0, static_cast<double>(kLayers));
    return std::max(1u, static_cast<std::uint32_t>(std::ceil(std::sqrt(bodies / layers))));
}
}  // namespace

BodyWorld::BodyWorld(std::string name, NamedBroadphase broadphase, BodyShapes shapes,
                     const WorldSceneOptions& options)
    : WorldScene(std::move(name), std::move(broadphase), options)
{
    const std::uint32_t columns = columnsFor(options.bodies);
    const std::uint32_t layers = options.bodies / (columns * columns) + 1;
    addWalledFloor(btScalar(columns) * kSpacing / 2 + btScalar(0.5), btScalar(layers + 4) * kSpacing);
    addBodies(keep(std::make_unique<BodyShapes>(std::move(shapes))));
}

void BodyWorld::addBodies(const BodyShapes& shapes)
{
    SplitMix64 random(options().seed);
    const std::uint32_t columns = columnsFor(options().bodies);
    const btScalar centre = btScalar(columns - 1) / 2;
    for (std::uint32_t i = 0; i < options().bodies; ++i)
    {
        const std::uint32_t layer = i / (columns * columns);
        const btVector3 cell(btScalar(i % columns) - centre, btScalar(layer),
                             btScalar(i / columns % columns) - centre);
        // In the order in which GCC evaluates arguments, which recorded hashes rely on.
        const float shiftZ = random.uniform(-0.1f, 0.1f), shiftX = random.uniform(-0.1f, 0.1f);
        const btVector3 shift(btScalar(shiftX), 0, btScalar(shiftZ));
        const btTransform transform(randomRotation(random),
                                    cell * kSpacing + shift + btVector3(0, btScalar(1.2), 0));
        addBody(*shapes.at(random.below(shapes.size())), 1, transform);
    }
}

std::unique_ptr<WorldScene> makeDropScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
    BodyShapes shapes;
    for (const HullPoints& hull : options.hulls)
        shapes.addHull(hull);
    shapes.addBox(btScalar(0.7));
    shapes.addSphere(btScalar(0.4));
    return std::make_unique<BodyWorld>(name, std::move(broadphase), std::move(shapes), options);
}

std::unique_ptr<WorldScene> makeBoxesScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options)
{
    BodyShapes shapes;
    shapes.addBox(btScalar(1));
    return std::make_unique<BodyWorld>(name, std::move(broadphase), std::move(shapes), options);
}

std::unique_ptr<WorldScene> makeHullsScene(const std::string& name, NamedBroadphase broadphase,
                                           const WorldSceneOptions& options)
{
    constexpr std::size_t kHullKinds = 8;
    BodyShapes shapes;
    for (const HullPoints& hull : makeRandomHulls(kHullKinds, options.hullPoints, options.seed))
        shapes.addHull(hull);
    return std::make_unique<BodyWorld>(name, std::move(broadphase), std::move(shapes), options);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
