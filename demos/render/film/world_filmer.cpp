// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/film/world_filmer.h"

#include <BulletDynamics/Vehicle/btRaycastVehicle.h>
#include <BulletSoftBody/btSoftBody.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <tuple>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Collects lines without drawing.
class LineCollector : public btIDebugDraw
{
public:
    void drawLine(const btVector3& from, const btVector3& to, const btVector3& color) override
    {
        lines.push_back({toEigen(from), toEigen(to), toEigen(color)});
    }
    void drawContactPoint(const btVector3&, const btVector3&, btScalar, int, const btVector3&) override {}
    void reportErrorWarning(const char*) override {}
    void draw3dText(const btVector3&, const char*) override {}
    void setDebugMode(int) override {}
    int getDebugMode() const override { return DBG_DrawAabb; }

    std::vector<FilmLine> lines;
};

bool isSame(const BodyChange& a, const BodyChange& b)
{
    return a.mesh == b.mesh && a.state == b.state && a.pose.position == b.pose.position &&
           a.pose.scale == b.pose.scale && a.pose.rotation == b.pose.rotation;
}

BodyPose poseOf(const btTransform& place, const Eigen::Vector3f& scale)
{
    const btQuaternion turn = place.getRotation();
    BodyPose pose;
    pose.scale = scale;
    pose.position = toEigen(place.getOrigin());
    pose.rotation = {static_cast<float>(turn.x()), static_cast<float>(turn.y()), static_cast<float>(turn.z()),
                     static_cast<float>(turn.w())};
    return pose;
}

bool touches(const btPersistentManifold& manifold)
{
    for (int i = 0; i < manifold.getNumContacts(); ++i)
    {
        if (manifold.getContactPoint(i).getDistance() <= 0)
            return true;
    }
    return false;
}

/// Unit vertex normals: the sums of adjacent face normals, weighted by area.
std::vector<Eigen::Vector3f> smoothNormals(const DrawMesh& mesh)
{
    std::vector<Eigen::Vector3f> normals(mesh.positions.size(), Eigen::Vector3f::Zero());
    for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3)
    {
        const std::uint32_t* const corner = &mesh.triangles[i];
        const Eigen::Vector3f& first = mesh.positions[corner[0]];
        const Eigen::Vector3f face =
            (mesh.positions[corner[1]] - first).cross(mesh.positions[corner[2]] - first);
        for (int k = 0; k < 3; ++k)
            normals[corner[k]] += face;
    }
    for (Eigen::Vector3f& normal : normals)
    {
        const float length = normal.norm();
        normal = length > 0 ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::UnitY();
    }
    return normals;
}

/// A soft body has smooth normals, since it is bent and not folded. Bullet's own normals are zero before the first
/// step.
DrawMesh makeSoftMesh(const btSoftBody& soft)
{
    DrawMesh mesh;
    const btSoftBody::Node* const nodes = soft.m_nodes.size() > 0 ? &soft.m_nodes[0] : nullptr;
    for (int i = 0; i < soft.m_nodes.size(); ++i)
        mesh.positions.push_back(toEigen(nodes[i].m_x));
    for (int i = 0; i < soft.m_faces.size(); ++i)
    {
        for (const btSoftBody::Node* node : soft.m_faces[i].m_n)
            mesh.triangles.push_back(static_cast<std::uint32_t>(node - nodes));
    }
    mesh.normals = smoothNormals(mesh);
    return mesh;
}
}  // namespace

std::vector<FilmLine> drawnLines(const Broadphase& broadphase, const DebugDrawOptions& options)
{
    LineCollector taker;
    broadphase.debugDraw(taker, options);
    return std::move(taker.lines);
}

WorldFilmer::WorldFilmer(Film& film, const DebugDrawOptions& overlay)
    : m_film(film), m_overlay(overlay), m_meshes(film)
{
}

std::uint32_t WorldFilmer::numberOf(const void* thing)
{
    const auto [found, isNew] = m_numbers.emplace(thing, m_film.bodyCount);
    if (isNew)
    {
        ++m_film.bodyCount;
        m_looks.emplace_back().body = found->second;
        m_meetings.push_back(kNone);
        m_seenIn.push_back(0);
    }
    return found->second;
}

void WorldFilmer::meet(const btCollisionObject* object, Meeting meeting)
{
    const auto found = m_numbers.find(object);
    if (found != m_numbers.end())
        m_meetings[found->second] = std::max(m_meetings[found->second], meeting);
}

void WorldFilmer::findContacts(const btCollisionWorld& world)
{
    std::fill(m_meetings.begin(), m_meetings.end(), kNone);
    const btOverlappingPairCache* cache = world.getBroadphase()->getOverlappingPairCache();
    const btBroadphasePair* pairs = cache->getOverlappingPairArrayPtr();
    for (int i = 0; i < cache->getNumOverlappingPairs(); ++i)
    {
        for (const btBroadphaseProxy* proxy : {pairs[i].m_pProxy0, pairs[i].m_pProxy1})
            meet(static_cast<const btCollisionObject*>(proxy->m_clientObject), kPair);
    }
    const btDispatcher* dispatcher = world.getDispatcher();
    for (int i = 0; i < dispatcher->getNumManifolds(); ++i)
    {
        const btPersistentManifold* manifold =
            const_cast<btDispatcher*>(dispatcher)->getManifoldByIndexInternal(i);
        if (!touches(*manifold))
            continue;
        meet(manifold->getBody0(), kContact);
        meet(manifold->getBody1(), kContact);
    }
}

BodyState WorldFilmer::stateOf(const btCollisionObject& object, std::uint32_t body) const
{
    if (object.getInternalType() == btCollisionObject::CO_GHOST_OBJECT)
        return BodyState::Ghost;
    if (object.isStaticObject())
        return BodyState::Static;
    if (!object.isActive())
        return BodyState::Asleep;
    const btSoftBody* const soft = btSoftBody::upcast(&object);
    if (m_meetings[body] == kContact ||
        (soft != nullptr && soft->m_rcontacts.size() + soft->m_scontacts.size() > 0))
        return BodyState::Touching;
    return m_meetings[body] == kPair ? BodyState::Near : BodyState::Separated;
}

void WorldFilmer::filmSoftBody(const btSoftBody& soft, BodyChange& look)
{
    const BodyChange& before = m_looks[look.body];
    DrawMesh mesh = makeSoftMesh(soft);
    look.mesh = before.mesh;
    if (before.state != BodyState::Hidden && m_film.meshes[before.mesh].positions == mesh.positions)
        return;
    look.mesh = static_cast<std::uint32_t>(m_film.meshes.size());
    m_film.meshes.push_back(std::move(mesh));
}

BodyChange WorldFilmer::lookAt(const btCollisionObject& object, std::uint32_t body)
{
    BodyChange look;
    look.body = body;
    look.state = stateOf(object, body);
    if (const btSoftBody* const soft = btSoftBody::upcast(&object))
    {
        filmSoftBody(*soft, look);
        return look;
    }
    const ShapeMeshes::Look shape = m_meshes.look(*object.getCollisionShape(), m_planeSize);
    look.mesh = shape.mesh;
    look.pose = poseOf(object.getWorldTransform(), shape.scale);
    return look;
}

/// Adds a look to the frame if it is new or has changed.
void WorldFilmer::see(const BodyChange& look, FilmFrame& frame)
{
    m_seenIn[look.body] = m_film.frames.size() + 1;
    if (isSame(look, m_looks[look.body]))
        return;
    frame.changes.push_back(look);
    m_looks[look.body] = look;
}

void WorldFilmer::filmWheels(const btRaycastVehicle& vehicle, FilmFrame& frame)
{
    constexpr float kHalfWidth = 0.4f;  // of the radius; Bullet's wheels have no width
    for (int i = 0; i < vehicle.getNumWheels(); ++i)
    {
        const btWheelInfo& wheel = vehicle.getWheelInfo(i);
        const float radius = static_cast<float>(wheel.m_wheelsRadius);
        BodyChange look;
        look.body = numberOf(&wheel);
        look.state = wheel.m_raycastInfo.m_isInContact ? BodyState::Touching : BodyState::Separated;
        look.mesh = m_meshes.look(m_wheel, m_planeSize).mesh;
        look.pose = poseOf(wheel.m_worldTransform, {kHalfWidth * radius, radius, radius});
        see(look, frame);
    }
}

void WorldFilmer::hideRemovedBodies(FilmFrame& frame)
{
    for (std::uint32_t body = 0; body < m_film.bodyCount; ++body)
    {
        if (m_seenIn[body] == m_film.frames.size() + 1 || m_looks[body].state == BodyState::Hidden)
            continue;
        m_looks[body].state = BodyState::Hidden;
        frame.changes.push_back(m_looks[body]);
    }
}

/// An endless plane is drawn some ten times as large as the world is at the start.
void WorldFilmer::setPlaneSize(const btCollisionWorld& world)
{
    constexpr btScalar kEndless = btScalar(0x1p50);
    btScalar farthest = 1;
    const btCollisionObjectArray& objects = world.getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i)
    {
        const btBroadphaseProxy* proxy = objects[i]->getBroadphaseHandle();
        const btScalar reach = proxy->m_aabbMax.absolute().length() + proxy->m_aabbMin.absolute().length();
        if (reach < kEndless)
            farthest = std::max(farthest, reach);
    }
    m_planeSize = 20 * farthest;
}

void WorldFilmer::shoot(const btCollisionWorld& world, double time,
                        const std::vector<const btRaycastVehicle*>& vehicles)
{
    const btCollisionObjectArray& objects = world.getCollisionObjectArray();
    if (m_planeSize == 0)
        setPlaneSize(world);
    for (int i = 0; i < objects.size(); ++i)
        numberOf(objects[i]);
    findContacts(world);

    FilmFrame frame;
    frame.time = time;
    for (int i = 0; i < objects.size(); ++i)
        see(lookAt(*objects[i], numberOf(objects[i])), frame);
    for (const btRaycastVehicle* vehicle : vehicles)
        filmWheels(*vehicle, frame);
    hideRemovedBodies(frame);
    const auto byBody = [](const BodyChange& a, const BodyChange& b) { return a.body < b.body; };
    std::sort(frame.changes.begin(), frame.changes.end(), byBody);
    const auto* const own = dynamic_cast<const Broadphase*>(world.getBroadphase());
    if (own != nullptr && (m_overlay.boxes || m_overlay.cells || m_overlay.pairs))
        frame.lines = drawnLines(*own, m_overlay);
    m_film.frames.push_back(std::move(frame));
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
