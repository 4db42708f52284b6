// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/narrow/narrow_trajectories.h"
#include "cullet/narrow/hull/support.h"

#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What is asked about a pair.
enum class NarrowQuery
{
    Boolean,   ///< do the shapes overlap?
    Distance,  ///< how far apart are they; 0 if they overlap
    Contacts,  ///< normal, points and signed distance of one contact, if the shapes are nearer than kContactDistance
    Algorithm,  ///< all that Bullet's dispatcher asks of a pair: the points of its manifold, brought up to date
    Dispatcher,  ///< the same of all pairs of a frame at once, by btCollisionDispatcher or cullet::Dispatcher
    Simplex,     ///< closest points of the simplices that GJK meets on its way; of solvers, not of libraries
    Still  ///< as Dispatcher, but of bodies in a lattice that do not move, six pairs for each, whatever the regime
};

inline bool isThroughDispatcher(NarrowQuery query)
{
    return query == NarrowQuery::Dispatcher || query == NarrowQuery::Still;
}

/// Asked in Bullet's terms, which other libraries do not have.
inline bool isBulletsOwn(NarrowQuery query)
{
    return query == NarrowQuery::Algorithm || isThroughDispatcher(query);
}

constexpr double kContactDistance = 0.02;  ///< Bullet's gContactBreakingThreshold

struct NarrowAnswer
{
    bool isOverlapping = false;
    /// Negative for a depth; NaN if the query did not ask for it, or the shapes are farther apart than asked.
    double distance = std::numeric_limits<double>::quiet_NaN();
};

/// Mean work per query; negative: not known.
struct NarrowWork
{
    double iterations = -1.0;
    double supports = -1.0;  ///< support points, those of both shapes counted
};

struct NarrowRequest
{
    const NarrowTrajectories& trajectories;
    NarrowQuery query;
    bool isWarm;  ///< a pair remembers its last query; ignored by those that cannot
    SupportMethod support = SupportMethod::Automatic;
};

/// One library's answers to all queries of some trajectories.
class NarrowSubject
{
public:
    virtual ~NarrowSubject() = default;

    /// Answers every query in order, without memory of an earlier call. Timed.
    virtual void run(std::vector<NarrowAnswer>& answers) = 0;

    /// Answers the same once more, where what run() does leaves answers open; not timed.
    virtual void tell(std::vector<NarrowAnswer>&) {}

    /// Runs once more and counts; not timed.
    virtual NarrowWork countWork() { return {}; }
};

struct NarrowSubjectInfo
{
    const char* name;
    const char* summary;  ///< or how to get it into this program, if `make` is null
    bool canBeWarm;
    std::unique_ptr<NarrowSubject> (*make)(const NarrowRequest& request);
    bool isSolver = false;  ///< of simplices: answers NarrowQuery::Simplex and nothing else
};

/// All libraries that this program may be built with.
const std::vector<NarrowSubjectInfo>& narrowSubjects();

std::unique_ptr<NarrowSubject> makeCulletNarrow(const NarrowRequest& request);
/// With Chung and Wang's steps before GJK; nullptr but for booleans.
std::unique_ptr<NarrowSubject> makeCulletReflectedNarrow(const NarrowRequest& request);
/// From one axis, and from four directions, with nothing else remembered; nullptr but for booleans and distances.
std::unique_ptr<NarrowSubject> makeCulletFromAxisNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCulletFromFourNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeBulletNarrow(const NarrowRequest& request);
/// The algorithm of a pair in Bullet's dispatcher: ISA-GJK's, or Bullet's own, which always keeps its manifold.
std::unique_ptr<NarrowSubject> makeAlgorithmNarrow(const NarrowRequest& request, bool isIsaGjk);
/// All pairs of a frame through a dispatcher, on one thread; nullptr for cullet's when cold.
std::unique_ptr<NarrowSubject> makeDispatcherNarrow(const NarrowRequest& request, bool isCullets);
/// By Voronoi regions, those of the newest point only and all; Johnson's; signed volumes.
std::unique_ptr<NarrowSubject> makeVoronoiSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeFullVoronoiSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeJohnsonSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeSignedVolumesSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCcdNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeFclNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCoalNarrow(const NarrowRequest& request);
}  // namespace CULLET_PRECISION
}  // namespace cullet
