// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/worlds/file_world.h"

#include "cullet/demos/program/exit_code.h"

#ifdef CULLET_HAS_IMPORTER
#include <BulletWorldImporter/btBulletWorldImporter.h>

#include <cstring>
#include <fstream>
#endif

namespace cullet
{
inline namespace CULLET_PRECISION
{
#ifdef CULLET_HAS_IMPORTER
namespace
{
/// Has no world, so that its data can be destroyed after the world.
class Importer : public btBulletWorldImporter
{
public:
    Importer() : btBulletWorldImporter(nullptr) {}
    ~Importer() override { deleteAllData(); }
};

void requireBulletFile(const std::string& path)
{
    if (path.empty())
        throw ProgramError(kExitUsage, "scene 'file' needs --file FILE, a .bullet file");
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw ProgramError(kExitInput, "world '" + path + "': cannot be opened");
    char head[6] = {};
    file.read(head, sizeof(head));
    if (std::memcmp(head, "BULLET", sizeof(head)) != 0)
        throw ProgramError(kExitInput, "world '" + path + "': not a .bullet file");
}

class FileWorld : public WorldScene
{
public:
    FileWorld(const std::string& name, NamedBroadphase broadphase, const WorldSceneOptions& scene)
        : WorldScene(name, std::move(broadphase), scene)
    {
        requireBulletFile(scene.file);
        Importer& importer = keep(std::make_unique<Importer>());
        if (!importer.loadFile(scene.file.c_str()) || importer.getNumRigidBodies() == 0)
            throw ProgramError(kExitInput,
                               "world '" + scene.file + "': Bullet's importer finds no rigid bodies in it");
        for (int i = 0; i < importer.getNumRigidBodies(); ++i)
        {
            btRigidBody* body = btRigidBody::upcast(importer.getRigidBodyByIndex(i));
            if (body != nullptr)
                world().addRigidBody(body);
        }
        for (int i = 0; i < importer.getNumConstraints(); ++i)
            world().addConstraint(importer.getConstraintByIndex(i));
        setBodyCount(static_cast<std::uint32_t>(world().getNumCollisionObjects()));
    }
};
}  // namespace
#endif

std::unique_ptr<WorldScene> makeFileScene(const std::string& name, NamedBroadphase broadphase,
                                          const WorldSceneOptions& options)
{
#ifdef CULLET_HAS_IMPORTER
    return std::make_unique<FileWorld>(name, std::move(broadphase), options);
#else
    static_cast<void>(options);
    throw ProgramError(kExitUnavailable, "scene '" + name + "' on '" + broadphase.name +
                                             "': this program was built without libbullet-extras-dev");
#endif
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
