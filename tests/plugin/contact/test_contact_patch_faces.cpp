// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/plugin/contact/patch_oracle.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>
#include <string>

namespace cullet::test
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPatchLimit = 0.03;
constexpr double kPatchSame = 0.02;

/// Tolerance for rounding of the positions, and for the certified depth of overlaps.
constexpr double kPlace = sizeof(btScalar) == 4 ? 4e-6 : 1e-13;
constexpr double kDeepPlace = sizeof(btScalar) == 4 ? 3e-5 : 1e-9;
/// The clipping tolerance of a polygon beyond a face, times the largest ratio of a 1-norm and a 2-norm.
constexpr double kOverhang = 0.05 * 1.42 * kPatchSame;

/// A core posed by a matrix of its points; a triangle and a segment like in the plug-in.
struct PatchShape
{
    std::string name;
    Hull<btScalar> hull;
    Matrix3d stretch;
    CoreSurface unmoved;
};

std::vector<PatchShape> patchShapes()
{
    std::vector<PatchShape> shapes;
    const auto addOne = [&](const std::string& name, const Points& points, const Matrix3d& stretch)
    {
        const Hull<btScalar> hull = hullOf<btScalar>(points);
        const PosedShape unmoved(hull, stretch.cast<btScalar>(), PosedShape::Vector::Zero());
        shapes.push_back({name, hull, stretch, CoreSurface(unmoved, Vector3d::Zero())});
    };
    const auto add = [&](const std::string& name, const Points& points)
    {
        for (const Vector3d& s : {Vector3d(1, 1, 1), Vector3d(2, 0.5, 1), Vector3d(1, -1, 3)})
            addOne(name, points, s.asDiagonal());
    };
    add("box8", boxPoints(0.7, 0.5, 0.6));
    add("gridbox98", gridBoxPoints(5));
    add("prism32", prismPoints(32, 0.5));
    add("prism1000", prismPoints(1000, 0.5));
    add("ico42", icoPoints(1));
    Matrix3d corners;
    corners << 1.5, 0.5, 0, 0, 1.2, 0, 0, 0, 1.8;
    addOne("triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, corners);
    addOne("segment", {{-1, 0, 0}, {1, 0, 0}}, Vector3d(0.8, 1, 1).asDiagonal());
    return shapes;
}

/// A point on the surface of a core before its rotation.
struct Spot
{
    Vector3d normal, point;
    double size;  ///< of the face there
};

/// A spot on a random face, half of the time on one with the most corners.
Spot anySpot(const PatchShape& shape, std::mt19937& engine)
{
    if (shape.unmoved.kind() == HullKind::Segment)
        return {Vector3d(0, 1, 0), Vector3d::Zero(), 0.8};
    const std::vector<CoreSurface::Side>& sides = shape.unmoved.sides();
    std::size_t most = 0;
    for (const CoreSurface::Side& side : sides)
        most = std::max(most, side.corners.size());
    const bool isLargest = engine() % 2 == 0;
    std::size_t at = engine() % sides.size();
    while (isLargest && sides[at].corners.size() < most)
        at = (at + 1) % sides.size();
    const CoreSurface::Side& side = sides[at];
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& p : side.corners)
        centre += p / static_cast<double>(side.corners.size());
    double size = 0.0;
    for (const Vector3d& p : side.corners)
        size = std::max(size, (p - centre).norm());
    return {side.normal, centre, size};
}

/// Two cores with nearly parallel faces, and their contact.
struct PatchScene
{
    PatchScene(const PatchShape& shapeA, const PatchShape& shapeB, double tilt, std::mt19937& engine)
    {
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        const Spot spotA = anySpot(shapeA, engine), spotB = anySpot(shapeB, engine);
        const Matrix3d turnA = randomRotation(engine);
        const Vector3d normal = turnA * spotA.normal;
        const Matrix3d facing =
            Eigen::Quaterniond::FromTwoVectors(spotB.normal, Vector3d(-normal)).toRotationMatrix();
        const Matrix3d turnB = Eigen::AngleAxisd(tilt, normal.unitOrthogonal()) *
                               Eigen::AngleAxisd(3.0 * unit(engine), normal) * facing;
        const Vector3d aside = Eigen::AngleAxisd(3.0 * unit(engine), normal) * normal.unitOrthogonal();
        const double lateral = 0.5 * unit(engine) * (spotA.size + spotB.size);
        const Vector3d origin = 10.0 * randomDirection(engine);
        const Vector3d meets =
            origin + turnA * spotA.point + (0.015 * unit(engine) + 0.005) * normal + lateral * aside;
        a.emplace(shapeA.hull, (turnA * shapeA.stretch).cast<btScalar>(), origin.cast<btScalar>());
        b.emplace(shapeB.hull, (turnB * shapeB.stretch).cast<btScalar>(),
                  (meets - turnB * spotB.point).cast<btScalar>());
    }

    /// Finds the contact like the algorithm of the plug-in. @return false if there is none
    bool findTouch(bool knowsVertices)
    {
        GjkCache<btScalar> cache;
        const GjkResult<btScalar> near = gjkDistance(*a, *b, btScalar(kPatchLimit), cache);
        if (near.state == GjkState::Near)
            touch = {near.axis.cast<double>().normalized(), double(near.distance), near.pointB.cast<double>(),
                     cache.startA, cache.startB};
        if (near.state == GjkState::Overlapping)
        {
            const PenetrationResult<btScalar> deep = penetration(*a, *b, cache);
            if (deep.state != GjkState::Overlapping || deep.method == PenetrationMethod::Flat)
                return false;
            touch = {deep.axis.cast<double>().normalized(), -double(deep.depth), deep.pointB.cast<double>(),
                     deep.vertexA, deep.vertexB};
        }
        if (!knowsVertices)
            touch.vertexA = touch.vertexB = -1;
        return near.state != GjkState::Separated;
    }

    std::optional<PosedShape> a, b;
    Touch touch = {};
};

struct PatchTally
{
    int patches = 0, areas = 0, lengths = 0, thinned = 0, mirrored = 0;
    double leastArea = 1.0, leastLength = 1.0, areaTotal = 0.0;
};

/// Checks the share of the exact patch that a patch covers, where the meeting faces are unambiguous, and neither patch
/// is a single point.
void checkCover(const PatchScene& scene, const CoreSurface& surfaceA, const CoreSurface& surfaceB,
                const Corners& points, PatchTally& tally)
{
    const Vector3d& normal = scene.touch.normal;
    const CoreSurface::Side* faceA = surfaceA.faceAlong(-normal);
    const CoreSurface::Side* faceB = surfaceB.faceAlong(normal);
    const bool isSegmentA = surfaceA.kind() == HullKind::Segment,
               isSegmentB = surfaceB.kind() == HullKind::Segment;
    if ((faceA == nullptr && !isSegmentA) || (faceB == nullptr && !isSegmentB) || (isSegmentA && isSegmentB))
        return;
    const CoreSurface::Side& reference = isSegmentA ? *faceB : *faceA;
    const Corners& other = isSegmentA ? surfaceA.points() : isSegmentB ? surfaceB.points() : faceB->corners;
    const auto carries = [&](const Vector3d& corner, double distance)
    {
        const double rise = distance - scene.touch.distance;
        const double aside = normal.cross(corner - scene.touch.onB).norm();
        return distance < kPatchLimit && (rise <= 0.1 * kPatchSame || rise <= 0.02 * aside);
    };
    const Corners exact = exactPatch(reference, other, normal, carries);
    const double length = lengthOf(exact, normal), area = areaOf(exact, normal);
    const bool isThinned = reference.corners.size() > 16 || other.size() > 16;
    // Sixteen corners of a round face omit a rim, here up to 0.06 wide, so intersections of the rims alone may be lost.
    if (length < 5.0 * kPatchSame || (isThinned && area < 0.25 * length))
        return;
    ++tally.lengths;
    const double covered = lengthOf(points, normal) / length;
    tally.leastLength = std::min(tally.leastLength, covered);
    // The farthest point from a corner is farther away than half of the diameter.
    EXPECT_GT(covered, 0.5);
    EXPECT_LT(covered, 1.0 + 8.0 * kOverhang / length + 1e-3);
    if (isSegmentA || isSegmentB || area < 5.0 * kPatchSame * length)
        return;
    ++tally.areas;
    const double share = areaOf(points, normal) / area;
    tally.leastArea = std::min(tally.leastArea, share);
    // No point is farther from the deepest than the farthest point, nor farther from the line through both than the
    // chosen point on its side, so at least a quarter is covered.
    EXPECT_GT(share, 0.25);
    tally.areaTotal += share;
    EXPECT_LT(share, 1.0 + 4.0 * kOverhang * length / area + 1e-3);
    tally.thinned += isThinned;
    tally.mirrored += scene.a->basis().determinant() < 0.0 || scene.b->basis().determinant() < 0.0;
}

void checkPatch(PatchScene& scene, bool knowsVertices, PatchTally& tally)
{
    if (!scene.findTouch(knowsVertices))
        return;
    const Touch& touch = scene.touch;
    const ContactPatch patch =
        makeContactPatch(*scene.a, *scene.b, touch, {kPatchLimit, btScalar(kPatchSame)});
    ASSERT_GE(patch.count, 1);
    ASSERT_LE(patch.count, 4);
    ++tally.patches;
    // Relative to the origin of A, like the contact.
    const CoreSurface surfaceA(*scene.a, scene.a->origin()), surfaceB(*scene.b, scene.a->origin());
    const double place = touch.distance < 0.0 ? kDeepPlace : kPlace;
    double deepest = kPatchLimit;
    Corners points;
    for (std::size_t i = 0; i < static_cast<std::size_t>(patch.count); ++i)
    {
        const ContactPoint& point = patch.points[i];
        const double distance = double(point.distance);
        const Vector3d onB = touch.onB + toEigen(point.fromTouch).cast<double>();
        const Vector3d onA = onB + distance * touch.normal;
        EXPECT_LT(surfaceB.offPlane(onB), place);
        EXPECT_LT(surfaceB.outside(onB), place + kOverhang);
        // Overhanging points would be deeper than the contact where the faces are not parallel, but their reported
        // distance is clamped.
        const bool isClamped = distance <= touch.distance;
        EXPECT_LT(surfaceA.offPlane(onA), place + (isClamped ? 0.3 * kOverhang : 0.0));
        EXPECT_LT(surfaceA.outside(onA), place + kOverhang);
        // Rounding must not make a contact deeper than the shapes.
        EXPECT_GE(point.distance, static_cast<btScalar>(touch.distance));
        EXPECT_LT(distance, kPatchLimit);
        deepest = std::min(deepest, distance);
        points.push_back(onB);
    }
    EXPECT_LE(deepest, touch.distance + 1.2e-3 * (kPatchLimit - touch.distance) + place);
    checkCover(scene, surfaceA, surfaceB, points, tally);
}
/// A steep plate over a rod. The plate's lower edge rises by `rise` for each metre along x from the touch, and the rod turns
/// away from below it, to where the plate is not.
struct PlateAndRod
{
    explicit PlateAndRod(std::mt19937& engine)
    {
        const auto between = [&engine](double low, double high)
        { return std::uniform_real_distribution<double>(low, high)(engine); };
        steepness = between(0.5, 1.5);
        rise = between(0, 0.01);
        turn = between(0, 1.5 * kOverhang / kReach);
        edge = Vector3d(1, rise, 0).normalized();
        const Vector3d upright = Vector3d(-edge.y(), edge.x(), 0);
        face = std::sin(steepness) * upright + std::cos(steepness) * Vector3d::UnitZ();
    }

    Points plate() const { return {Vector3d::Zero(), 2 * edge, face, 2 * edge + face}; }
    Points rod() const { return {Vector3d(-kReach, 0, kReach * turn), Vector3d(kReach, 0, -kReach * turn)}; }

    /// How far a point is from the plate, whose lower corner is at 0.
    double outside(const Vector3d& point) const
    {
        const double along = std::min(std::max(point.dot(edge), 0.0), 2.0);
        const double up = std::min(std::max(point.dot(face), 0.0), 1.0);
        return (point - along * edge - up * face).norm();
    }

    static constexpr double kReach = 0.7;
    double steepness;  ///< angle to the level, in radians
    double rise, turn;
    Vector3d edge, face;
};
}  // namespace

TEST(ContactPatch, LiesOnBothSurfacesAndCoversExactClipForAllFaces)
{
    const std::vector<PatchShape> shapes = patchShapes();
    std::mt19937 engine(77);
    PatchTally tally;
    for (int i = 0; i < 3000; ++i)
    {
        const PatchShape& a = shapes[engine() % shapes.size()];
        const PatchShape& b = shapes[engine() % shapes.size()];
        // Limits the cost of brute force.
        if (a.hull.vertexCount() + b.hull.vertexCount() > 2000 && i % 8 != 0)
            continue;
        const double tilt = std::array<double, 5>{0.0, 1e-6, 1e-3, 0.01, 0.3}[engine() % 5];
        SCOPED_TRACE(testing::Message() << a.name << ' ' << b.name << " scene " << i << ", tilt " << tilt);
        PatchScene scene(a, b, tilt, engine);
        checkPatch(scene, engine() % 2 == 0, tally);
    }
    RecordProperty("leastArea", std::to_string(tally.leastArea));
    RecordProperty("leastLength", std::to_string(tally.leastLength));
    EXPECT_GT(tally.patches, 1000);
    EXPECT_GT(tally.lengths, 500);
    EXPECT_GT(tally.areas, 300);
    EXPECT_GT(tally.areaTotal, 0.8 * tally.areas);
    EXPECT_GT(tally.thinned, 100);
    EXPECT_GT(tally.mirrored, 100);
}

TEST(ContactPatch, LiesOnSteepFaceUpToToleranceWhenOtherReachesBesideIt)
{
    constexpr unsigned kSeed = 79;
    std::mt19937 engine(kSeed);
    int beside = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const PlateAndRod pose(engine);
        const Hull<btScalar> plate = hullOf<btScalar>(pose.plate()), rod = hullOf<btScalar>(pose.rod());
        const Matrix3d unturned = Matrix3d::Identity();
        const PosedShape a(plate, unturned.cast<btScalar>(), PosedShape::Vector(0, btScalar(kPatchSame), 0));
        const PosedShape b(rod, unturned.cast<btScalar>(), PosedShape::Vector::Zero());
        const Touch touch = {Vector3d::UnitY(), kPatchSame, -kPatchSame * Vector3d::UnitY(), -1, -1};
        const ContactPatch patch = makeContactPatch(a, b, touch, {100, btScalar(kPatchSame)});
        ASSERT_GE(patch.count, 1) << "pose " << i << " of seed " << kSeed;
        for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count); ++k)
        {
            const ContactPoint& point = patch.points[k];
            const Vector3d onA = toEigen(point.fromTouch).cast<double>() +
                                 (double(point.distance) - kPatchSame) * Vector3d::UnitY();
            EXPECT_LE(pose.outside(onA), 2 * 0.05 * kPatchSame + kPlace)
                << "pose " << i << " of seed " << kSeed;
            beside += onA.z() < -0.1 * kOverhang;
        }
    }
    EXPECT_GT(beside, 100);
}
}  // namespace cullet::test
