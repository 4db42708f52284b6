// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/render/camera.h"
#include "cullet/demos/render/film/film.h"
#include "cullet/demos/render/film/scene_film.h"
#include "cullet/demos/render/film/world_filmer.h"
#include "cullet/demos/render/image/gltf.h"
#include "cullet/demos/render/shape_mesh.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/scene.h>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <unistd.h>

namespace cullet
{
namespace
{
/// Volume enclosed by the triangles; negative if they are inside out.
double volumeOf(const DrawMesh& mesh)
{
    double sum = 0;
    for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3)
    {
        const Eigen::Vector3f &a = mesh.positions[mesh.triangles[i]],
                              &b = mesh.positions[mesh.triangles[i + 1]],
                              &c = mesh.positions[mesh.triangles[i + 2]];
        sum += static_cast<double>(a.dot(b.cross(c))) / 6;
    }
    return sum;
}

void expectSoundMesh(const DrawMesh& mesh)
{
    ASSERT_EQ(mesh.positions.size(), mesh.normals.size());
    for (const std::uint32_t index : mesh.triangles)
        ASSERT_LT(index, mesh.positions.size());
    for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3)
    {
        Eigen::Vector3f corners[3], mean = Eigen::Vector3f::Zero();
        for (int k = 0; k < 3; ++k)
        {
            corners[k] = mesh.positions[mesh.triangles[i + static_cast<std::size_t>(k)]];
            mean += mesh.normals[mesh.triangles[i + static_cast<std::size_t>(k)]];
            EXPECT_NEAR(mesh.normals[mesh.triangles[i + static_cast<std::size_t>(k)]].norm(), 1, 1e-4);
        }
        EXPECT_GE((corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(mean), -1e-6f);
    }
}

/// A world with a floor, a box that falls onto it, one at rest far away, and a ghost.
struct SmallWorld
{
    SmallWorld()
        : floorShape(btVector3(0, 1, 0), 0),
          boxShape(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))),
          world(&dispatcher, &broadphase, &solver, &configuration)
    {
        add(floorShape, 0, btVector3(0, 0, 0));
        falling = add(boxShape, 1, btVector3(0, 3, 0));
        resting = add(boxShape, 1, btVector3(20, btScalar(0.5), 0));
        resting->setActivationState(ISLAND_SLEEPING);
    }

    ~SmallWorld()
    {
        for (const auto& body : bodies)
            world.removeRigidBody(body.get());
    }

    btRigidBody* add(btCollisionShape& shape, btScalar mass, const btVector3& place)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape.calculateLocalInertia(mass, inertia);
        bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
        btTransform transform = btTransform::getIdentity();
        transform.setOrigin(place);
        bodies.back()->setWorldTransform(transform);
        world.addRigidBody(bodies.back().get());
        return bodies.back().get();
    }

    btStaticPlaneShape floorShape;
    btBoxShape boxShape;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    Broadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    btRigidBody *falling = nullptr, *resting = nullptr;
};

DebugDrawOptions pairsOnly()
{
    DebugDrawOptions options;
    options.boxes = options.cells = false;
    return options;
}

Film filmSmallWorld(int frames)
{
    SmallWorld small;
    Film film;
    WorldFilmer filmer(film, pairsOnly());
    for (int frame = 0; frame < frames; ++frame)
    {
        filmer.shoot(small.world, frame / 60.0);
        small.world.stepSimulation(btScalar(1.0 / 60), 0);
    }
    return film;
}
}  // namespace

TEST(DrawMesh, EnclosesVolumeOfSolidsAndFacesOutward)
{
    const double pi = std::acos(-1.0);
    const auto check = [](const DrawMesh& mesh, double volume, double tolerance)
    {
        expectSoundMesh(mesh);
        EXPECT_NEAR(volumeOf(mesh), volume, tolerance * volume);
    };
    check(makeCubeMesh(), 1, 1e-6);
    check(Film().meshes[Film::kSphere], 4 * pi / 3, 0.02);
    btCapsuleShapeX capsule(1, 2);
    check(makeShapeMesh(capsule, 1), 2 * pi + 4 * pi / 3, 0.03);
    btCylinderShapeZ cylinder(btVector3(2, 2, 1));
    check(makeShapeMesh(cylinder, 1), 8 * pi, 0.03);
    btConeShape cone(1, 3);
    check(makeShapeMesh(cone, 1), pi, 0.03);
    const btScalar points[][3] = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 3}};
    btConvexHullShape hull(points[0], 4, 3 * sizeof(btScalar));
    hull.setMargin(0);
    check(makeShapeMesh(hull, 1), 4.5, 1e-4);
    const btVector3 centres[] = {btVector3(0, 0, 0), btVector3(2, 0, 0)};
    const btScalar radii[] = {1, 1};
    btMultiSphereShape spheres(centres, radii, 2);
    check(makeShapeMesh(spheres, 1), 2 * pi + 4 * pi / 3, 0.06);
    btBoxShape box(btVector3(1, 1, 1));
    btCompoundShape compound;
    btTransform place(btQuaternion(btVector3(0, 0, 1), 1), btVector3(5, 0, 0));
    compound.addChildShape(place, &box);
    compound.addChildShape(btTransform::getIdentity(), &cone);
    ShapeMeshes::Look look{0, Eigen::Vector3f::Zero()};
    Film film;
    look = ShapeMeshes(film).look(compound, 1);
    check(film.meshes[look.mesh], 8 + pi, 0.03);
}

TEST(DrawMesh, HasTrianglesOfMeshesHeightFieldsAndPlanes)
{
    btTriangleMesh triangles;
    triangles.addTriangle(btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(0, 1, 0));
    triangles.addTriangle(btVector3(0, 0, 0), btVector3(0, 1, 0), btVector3(-1, 0, 0));
    btBvhTriangleMeshShape mesh(&triangles, true);
    EXPECT_EQ(makeShapeMesh(mesh, 1).triangles.size(), 6u);
    const float heights[9] = {0, 1, 0, 1, 2, 1, 0, 1, 0};
    btHeightfieldTerrainShape field(3, 3, heights, 1, 0, 2, 1, PHY_FLOAT, false);
    EXPECT_EQ(makeShapeMesh(field, 1).triangles.size(), 3u * 8);
    const DrawMesh plane = makeShapeMesh(btStaticPlaneShape(btVector3(0, 1, 0), 2), 10);
    expectSoundMesh(plane);
    ASSERT_EQ(plane.triangles.size(), 6u);
    for (const Eigen::Vector3f& position : plane.positions)
        EXPECT_NEAR(position.y(), 2, 1e-5);
    EXPECT_NEAR(plane.normals[0].y(), 1, 1e-5);
    EXPECT_TRUE(makeShapeMesh(btEmptyShape(), 1).triangles.empty());
}

TEST(WorldFilmer, RecordsBodyStatesAndOmitsUnchangedBodies)
{
    const Film film = filmSmallWorld(60);
    ASSERT_EQ(film.bodyCount, 3u);
    FilmState state(film);
    std::set<BodyState> seen;
    for (const FilmFrame& frame : film.frames)
    {
        state.apply(frame);
        EXPECT_EQ(state.bodies()[0].state, BodyState::Static);
        EXPECT_EQ(state.bodies()[2].state, BodyState::Asleep);
        seen.insert(state.bodies()[1].state);
        if (&frame != &film.frames[0])
        {
            EXPECT_LE(frame.changes.size(), 1u);
        }
    }
    EXPECT_EQ(seen, (std::set<BodyState>{BodyState::Separated, BodyState::Near, BodyState::Touching}))
        << "no pairs before the first step";
    EXPECT_NEAR(state.bodies()[1].pose.position.y(), 0.5, 0.1);
    EXPECT_EQ(state.bodies()[1].pose.scale, Eigen::Vector3f(1, 1, 1));
    EXPECT_EQ(film.frames.back().lines.size(), 2u) << "the plane is in a pair with each box";
}

TEST(WorldFilmer, ShowsVehicleWheelsUprightAndTouchingFloor)
{
    SceneFilmOptions options;
    options.scene = "stampede";
    options.world.bodies = 1;
    options.world.threads = 1;
    options.steps = 60;
    const Film film = filmScene(options, [](int) { return true; });
    ASSERT_EQ(film.bodyCount, 7u) << "the floor, a bump, the chassis and its wheels";
    FilmState state(film);
    state.apply(film.frames.front());
    const auto countTouching = [&]
    {
        return std::count_if(state.bodies().begin() + 3, state.bodies().end(),
                             [](const BodyChange& body) { return body.state == BodyState::Touching; });
    };
    EXPECT_EQ(countTouching(), 0) << "in the air before the first step";
    for (const FilmFrame& frame : film.frames)
        state.apply(frame);
    EXPECT_GE(countTouching(), 3);
    for (std::size_t i = 3; i < 7; ++i)
    {
        const BodyChange& wheel = state.bodies()[i];
        Eigen::AlignedBox3f box;
        for (const Eigen::Vector3f& position : film.meshes[wheel.mesh].positions)
            box.extend(wheel.pose.toMatrix() * position);
        // Radius 0.4, width 0.32, with little steering.
        EXPECT_NEAR(box.sizes().y(), 0.8, 0.1) << i;
        EXPECT_NEAR(box.sizes().z(), 0.8, 0.1) << i;
        EXPECT_NEAR(box.sizes().x(), 0.32, 0.15) << i;
        EXPECT_NEAR(box.min().y(), 0, 0.15) << i;
    }
}

TEST(WorldFilmer, HidesBodiesWhileTheyAreRemoved)
{
    SmallWorld small;
    Film film;
    WorldFilmer filmer(film, pairsOnly());
    filmer.shoot(small.world, 0);
    small.world.removeRigidBody(small.resting);
    filmer.shoot(small.world, 1);
    small.world.addRigidBody(small.resting);
    filmer.shoot(small.world, 2);
    FilmState state(film);
    const BodyState expected[] = {BodyState::Asleep, BodyState::Hidden, BodyState::Asleep};
    for (int frame = 0; frame < 3; ++frame)
    {
        state.apply(film.frames[static_cast<std::size_t>(frame)]);
        EXPECT_EQ(state.bodies()[2].state, expected[frame]) << frame;
    }
    EXPECT_EQ(film.bodyCount, 3u);
}

TEST(SceneFilm, HasValidMeshesOfEverySceneBeforeFirstStep)
{
    for (const WorldSceneInfo& scene : worldScenes())
    {
        if (std::string(scene.name) == "file")
            continue;
        SceneFilmOptions options;
        options.scene = scene.name;
        options.world.bodies = 12;
        options.world.threads = 1;
        options.steps = 0;
        const Film film = filmScene(options, [](int) { return true; });
        ASSERT_EQ(film.frames.size(), 1u) << scene.name;
        for (std::size_t mesh = 0; mesh < film.meshes.size(); ++mesh)
        {
            SCOPED_TRACE(std::string(scene.name) + ", mesh " + std::to_string(mesh));
            expectSoundMesh(film.meshes[mesh]);
        }
        for (const BodyChange& body : film.frames[0].changes)
            EXPECT_TRUE(body.pose.toMatrix().matrix().allFinite()) << scene.name << body.body;
    }
}

TEST(Camera, FramesWhatMovesAndNotWhatRests)
{
    const Film film = filmSmallWorld(60);
    const Camera camera = aimCameras(film, {}, 16.0f / 9).at(0);
    EXPECT_NEAR(camera.target.x(), 0, 0.1) << "not the box that sleeps at x = 20";
    EXPECT_LT(camera.radius, 4);
    const float distance = (camera.eye - camera.target).norm();
    EXPECT_GT(distance, camera.radius);
    EXPECT_LT(distance, 8 * camera.radius);
    EXPECT_GT(camera.eye.y(), camera.target.y());
    CameraOptions cameraOptions;
    cameraOptions.orbit = 360;
    const std::vector<Camera> around = aimCameras(film, cameraOptions, 1);
    ASSERT_EQ(around.size(), film.frames.size());
    EXPECT_LT((around[0].eye - around[30].eye).norm(), 2.1f * (around[0].eye - around[0].target).norm());
    EXPECT_GT((around[0].eye - around[30].eye).norm(), 1.5f * (around[0].eye - around[0].target).norm());
}

TEST(Camera, TakesAnglesOrTwoPointsAndNothingElse)
{
    EXPECT_EQ(parseCamera({10, 20}).pitch, 20);
    EXPECT_EQ(parseCamera({10, 20, 2}).zoom, 2);
    EXPECT_EQ(parseCamera({1, 2, 3, 4, 5, 6}).fixed.size(), 6u);
    EXPECT_THROW(parseCamera({1}), std::invalid_argument);
    EXPECT_THROW(parseCamera({1, 90}), std::invalid_argument);
    EXPECT_THROW(parseCamera({1, 2, 0}), std::invalid_argument);
}

namespace
{
/// Checks the specification's requirements on accessors, views and buffers.
void expectSoundBuffers(const nlohmann::json& gltf, std::uintmax_t fileSize)
{
    ASSERT_EQ(gltf["buffers"].size(), 1u);
    EXPECT_EQ(gltf["buffers"][0]["byteLength"], fileSize);
    for (const auto& accessor : gltf["accessors"])
    {
        const auto& view = gltf["bufferViews"].at(accessor["bufferView"].get<std::size_t>());
        const std::size_t width = accessor["type"] == "SCALAR" ? 1 : accessor["type"] == "VEC3" ? 3 : 4;
        EXPECT_EQ(view["byteLength"], 4 * width * accessor["count"].get<std::size_t>());
        EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
        EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), fileSize);
    }
    for (const auto& mesh : gltf["meshes"])
    {
        const auto& positions =
            gltf["accessors"].at(mesh["primitives"][0]["attributes"]["POSITION"].get<std::size_t>());
        EXPECT_EQ(positions["min"].size(), 3u) << "the specification wants bounds of positions";
        EXPECT_EQ(positions["max"].size(), 3u);
    }
}

struct TemporaryGltf
{
    ~TemporaryGltf()
    {
        std::remove(path.c_str());
        std::remove(binary.c_str());
    }

    nlohmann::json read() const
    {
        std::ifstream file(path);
        return nlohmann::json::parse(file);
    }

    std::string stem = testing::TempDir() + "cullet_film_" + std::to_string(getpid());
    std::string path = stem + ".gltf", binary = stem + ".bin";
};
}  // namespace

TEST(Gltf, HasValidAccessorsBoundsAndSamplers)
{
    const Film film = filmSmallWorld(50);
    const TemporaryGltf file;
    writeGltf(film, file.path);
    const auto gltf = file.read();
    EXPECT_EQ(gltf["asset"]["version"], "2.0");
    EXPECT_EQ(gltf["nodes"].size(), 3u);
    expectSoundBuffers(gltf, std::filesystem::file_size(file.binary));

    ASSERT_EQ(gltf["animations"].size(), 1u);
    const auto& animation = gltf["animations"][0];
    EXPECT_EQ(animation["channels"].size(), animation["samplers"].size());
    std::set<std::pair<int, std::string>> targets;
    for (const auto& channel : animation["channels"])
    {
        EXPECT_TRUE(targets.emplace(channel["target"]["node"], channel["target"]["path"]).second);
        const auto& sampler = animation["samplers"].at(channel["sampler"].get<std::size_t>());
        const auto& times = gltf["accessors"].at(sampler["input"].get<std::size_t>());
        EXPECT_EQ(times["count"], film.frames.size());
        EXPECT_NEAR(times["max"][0].get<double>(), 49 / 60.0, 1e-6);
        EXPECT_EQ(gltf["accessors"].at(sampler["output"].get<std::size_t>())["count"], film.frames.size());
    }
    EXPECT_EQ(targets.count({1, "translation"}), 1u) << "the falling box";
    EXPECT_EQ(targets.count({2, "translation"}), 0u) << "the sleeping box";
}

TEST(Gltf, GivesSameMotionWhenReadByAssimp)
{
    const Film film = filmSmallWorld(50);
    const TemporaryGltf file;
    writeGltf(film, file.path);
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(file.path, 0);
    ASSERT_NE(scene, nullptr) << importer.GetErrorString();
    EXPECT_EQ(scene->mRootNode->mNumChildren, 3u);
    ASSERT_EQ(scene->mNumAnimations, 1u);
    const aiNodeAnim* channel = scene->mAnimations[0]->mChannels[0];
    EXPECT_STREQ(channel->mNodeName.C_Str(), "body 1");
    ASSERT_EQ(channel->mNumPositionKeys, film.frames.size());
    FilmState state(film);
    for (unsigned frame = 0; frame < channel->mNumPositionKeys; ++frame)
    {
        state.apply(film.frames[frame]);
        const Eigen::Vector3f& place = state.bodies()[1].pose.position;
        EXPECT_EQ(channel->mPositionKeys[frame].mValue, aiVector3D(place.x(), place.y(), place.z()));
        EXPECT_NEAR(channel->mPositionKeys[frame].mTime, 1000 * frame / 60.0, 0.01);
    }
    EXPECT_EQ(scene->mMeshes[1]->mNumFaces, 12u);
}

TEST(Gltf, ScalesBodiesThatComeAndGoInSteps)
{
    SmallWorld small;
    Film film;
    WorldFilmer filmer(film, pairsOnly());
    filmer.shoot(small.world, 0);
    small.world.removeRigidBody(small.resting);
    filmer.shoot(small.world, 1);
    small.world.addRigidBody(small.resting);
    const TemporaryGltf file;
    writeGltf(film, file.path);
    const auto gltf = file.read();
    bool hasScale = false;
    for (const auto& channel : gltf["animations"][0]["channels"])
    {
        if (channel["target"]["path"] != "scale")
            continue;
        hasScale = true;
        EXPECT_EQ(channel["target"]["node"], 2);
        EXPECT_EQ(
            gltf["animations"][0]["samplers"].at(channel["sampler"].get<std::size_t>())["interpolation"],
            "STEP");
    }
    EXPECT_TRUE(hasScale);
}

TEST(Gltf, ThrowsWhenFileCannotBeWritten)
{
    EXPECT_THROW(writeGltf(Film(), "film.obj"), std::invalid_argument);
    EXPECT_THROW(writeGltf(Film(), "/nowhere/film.gltf"), ProgramError);
}
}  // namespace cullet
