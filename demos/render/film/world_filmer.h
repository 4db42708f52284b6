// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/render/film/film.h"
#include "cullet/demos/render/shape_mesh.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/core/debug_draw_options.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>

#include <unordered_map>
#include <vector>

class btRaycastVehicle;
class btSoftBody;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The lines that a broad phase draws.
std::vector<FilmLine> drawnLines(const Broadphase& broadphase, const DebugDrawOptions& options);

/// Films any Bullet world: shapes, places and states of all its objects, one frame for each shoot().
///
/// Rigid and soft bodies and ghosts, which may enter and leave the world, and the wheels of vehicles, which are no
/// objects. Shapes must outlive this object. Cost of a frame: O(objects + manifolds + pairs), and memory for the
/// changes.
class WorldFilmer
{
public:
    /// @param overlay debug drawing of the broad phase, if it is cullet's; all off: none
    WorldFilmer(Film& film, const DebugDrawOptions& overlay);

    /// @param time     seconds since the start
    /// @param vehicles of the world, whose wheels are drawn: Touching if their rays hit
    void shoot(const btCollisionWorld& world, double time,
               const std::vector<const btRaycastVehicle*>& vehicles = {});

private:
    enum Meeting : std::uint8_t
    {
        kNone,
        kPair,
        kContact
    };

    std::uint32_t numberOf(const void* thing);
    void see(const BodyChange& look, FilmFrame& frame);
    void filmWheels(const btRaycastVehicle& vehicle, FilmFrame& frame);
    void hideRemovedBodies(FilmFrame& frame);
    void findContacts(const btCollisionWorld& world);
    void meet(const btCollisionObject* object, Meeting meeting);
    BodyState stateOf(const btCollisionObject& object, std::uint32_t body) const;
    BodyChange lookAt(const btCollisionObject& object, std::uint32_t body);
    void filmSoftBody(const btSoftBody& soft, BodyChange& look);
    void setPlaneSize(const btCollisionWorld& world);

    Film& m_film;
    DebugDrawOptions m_overlay;
    ShapeMeshes m_meshes;
    btScalar m_planeSize = 0;
    const btCylinderShapeX m_wheel{btVector3(1, 1, 1)};
    std::unordered_map<const void*, std::uint32_t> m_numbers;  ///< of objects and wheels
    std::vector<BodyChange> m_looks;                           ///< [bodies] as of the last frame
    std::vector<Meeting> m_meetings;                           ///< [bodies] of this frame
    std::vector<std::size_t> m_seenIn;  ///< [bodies] 1 + the last frame with the body in the world
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
