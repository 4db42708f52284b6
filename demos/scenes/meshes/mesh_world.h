// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/world_scene.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
enum class MeshMotion : std::uint8_t
{
    Free,     ///< bodies lie on the mesh, without friction, and the caller moves them
    Rest,     ///< bodies lie on the mesh
    Sliding,  ///< at 5 m/s without friction; the speed is set anew in each step
    Falling   ///< from up to two metres, in any rotation, and again after 40 steps
};

/// Bodies of one shape over one kind of mesh.
struct MeshCase
{
    std::string shape = "hull64";  ///< one of meshShapeNames()
    std::string mesh = "0.5m";     ///< one of meshNames()
    MeshMotion motion = MeshMotion::Rest;
    int bodies = 36;
    double reach = 24;  ///< half the width of the mesh, in metres
    double apart = 3;   ///< distance of neighbours in the square of bodies, in metres
    std::uint64_t seed = 1;
};

/// Shapes of about a metre: sphere, box, capsule, cylinder, hull16, hull64, hull200, compound (of five hulls), gimpact (a
/// torus of 192 triangles) and convex-mesh (btConvexTriangleMeshShape of 80 triangles); for quality also small-sphere and
/// small-box (0.1 m) and long-box (10 m).
const std::vector<std::string>& meshShapeNames();

/// Meshes with slopes of up to 5 degrees and edges of 0.5m, 0.1m or 5m; of 0.5 m also as heightfield, scaled and
/// multi-material; flat: level, of 0.5 m, and flat-0.25m; needles: of 2 cm by 8 m.
const std::vector<std::string>& meshNames();

/// Distances of corners in a lattice, in metres.
struct MeshSpacing
{
    double x, z;
};

/// A world of a MeshCase, with Bullet's broad phase. Bodies meet the mesh, and not each other.
class MeshWorld final : public WorldScene
{
public:
    /// @param narrow one of narrowPhaseNames(); of one thread
    MeshWorld(const MeshCase& meshCase, const std::string& narrow);

    std::size_t size() const { return m_bodies.size(); }
    btRigidBody& body(std::size_t i) { return *m_bodies[i]; }

    /// Triangles in the box of a body, on average.
    double trianglesPerBody() const;

protected:
    void direct() override;

private:
    btCollisionShape& makeBodyShape();
    btCollisionShape& makeHull(int points);
    btCollisionShape& makeCompound();
    btCollisionShape& makeTorus();
    btCollisionShape& makeConvexMesh();
    btConcaveShape& makeMesh();
    btConcaveShape& makeHeightField(double spacing);
    btTriangleMesh& makeTriangles(const MeshSpacing& spacing, double scale);
    void addBodies();
    void place(std::size_t i);
    double heightAt(double x, double z) const;

    MeshCase m_case;
    SplitMix64 m_random;
    btConcaveShape* m_mesh = nullptr;
    std::vector<btRigidBody*> m_bodies;
    std::vector<btVector3> m_sites;  ///< of the bodies at the start, y: of a body that lies there
    int m_step = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
