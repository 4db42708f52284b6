// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/demos/scenes/box_scene.h"

#include <memory>
#include <string>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A scene of boxes as a world: each box is an object without response, a frame is a step.
///
/// The proxies' boxes are those of the box scene grown by Bullet's contact threshold of 0.02. Objects that the scene
/// does not move in a step are set, too, as Bullet does by default.
class FlyingWorld : public WorldScene
{
public:
    /// @param shape of all objects; null: a box as large as the scene's, for each
    FlyingWorld(std::string name, NamedBroadphase broadphase, const WorldSceneOptions& options,
                std::unique_ptr<BoxScene> scene, std::unique_ptr<btCollisionShape> shape);

private:
    void direct() override;

    std::unique_ptr<BoxScene> m_scene;
};

/// The box scene of the same name.
std::unique_ptr<WorldScene> makeFlyingScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options);

/// Scene "thesis": the positions and velocities of W1; spheres of radius 1 with 80 triangles, as convex hulls.
std::unique_ptr<WorldScene> makeThesisScene(const std::string& name, NamedBroadphase broadphase,
                                            const WorldSceneOptions& options);
}  // namespace CULLET_PRECISION
}  // namespace cullet
