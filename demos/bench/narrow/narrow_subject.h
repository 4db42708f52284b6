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
/// The question about a pair.
enum class NarrowQuery
{
    Boolean,     ///< do the shapes overlap?
    Distance,    ///< how far apart are they; 0 if they overlap
    Contacts,    ///< normal, points and signed distance of one contact, below kContactDistance
    Algorithm,   ///< the work of Bullet's dispatcher for a pair: an up-to-date manifold
    Dispatcher,  ///< that for all pairs of a frame, by btCollisionDispatcher or cullet::Dispatcher
    Simplex,     ///< closest points of the simplices of GJK; for solvers, not for libraries
    Still        ///< Dispatcher for unmoving bodies in a lattice, six pairs for each; ignores the regime
};

inline bool isThroughDispatcher(NarrowQuery query)
{
    return query == NarrowQuery::Dispatcher || query == NarrowQuery::Still;
}

/// Whether the query exists for Bullet's interface only.
inline bool isBulletsOwn(NarrowQuery query)
{
    return query == NarrowQuery::Algorithm || isThroughDispatcher(query);
}

constexpr double kContactDistance = 0.02;  ///< Bullet's gContactBreakingThreshold

struct NarrowAnswer
{
    bool isOverlapping = false;
    /// Negative for a depth; NaN if the query does not compute it, or the shapes are farther apart than its limit.
    double distance = std::numeric_limits<double>::quiet_NaN();
};

/// Mean work per query; negative: unknown.
struct NarrowWork
{
    double iterations = -1.0;
    double supports = -1.0;  ///< support points, those of both shapes counted
};

struct NarrowRequest
{
    const NarrowTrajectories& trajectories;
    NarrowQuery query;
    bool isWarm;  ///< a pair keeps the state of its last query; ignored by libraries without such state
    SupportMethod support = SupportMethod::Automatic;
};

/// One library's answers to all queries of some trajectories.
class NarrowSubject
{
public:
    virtual ~NarrowSubject() = default;

    /// Answers every query in order, without state from earlier calls. Timed.
    virtual void run(std::vector<NarrowAnswer>& answers) = 0;

    /// Completes answers that run() leaves open; not timed.
    virtual void completeAnswers(std::vector<NarrowAnswer>&) {}

    /// Runs once more and counts; not timed.
    virtual NarrowWork countWork() { return {}; }
};

struct NarrowSubjectInfo
{
    const char* name;
    const char* summary;  ///< or how to build with it, if `make` is null
    bool canBeWarm;
    std::unique_ptr<NarrowSubject> (*make)(const NarrowRequest& request);
    bool isSolver = false;  ///< answers NarrowQuery::Simplex only
};

/// All libraries that this program may be built with.
const std::vector<NarrowSubjectInfo>& narrowSubjects();

std::unique_ptr<NarrowSubject> makeCulletNarrow(const NarrowRequest& request);
/// With Chung and Wang's steps before GJK; nullptr for all queries but booleans.
std::unique_ptr<NarrowSubject> makeCulletReflectedNarrow(const NarrowRequest& request);
/// Search from one axis, and from four directions, without other cached state; nullptr for queries other than booleans
/// and distances.
std::unique_ptr<NarrowSubject> makeCulletFromAxisNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCulletFromFourNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeBulletNarrow(const NarrowRequest& request);
/// The algorithm of a pair in Bullet's dispatcher: ISA-GJK's, or Bullet's, which always keeps its manifold.
std::unique_ptr<NarrowSubject> makeAlgorithmNarrow(const NarrowRequest& request, bool isIsaGjk);
/// All pairs of a frame through a dispatcher, on one thread; nullptr for cullet's dispatcher with cold pairs.
std::unique_ptr<NarrowSubject> makeDispatcherNarrow(const NarrowRequest& request, bool isCullets);
/// Solvers by Voronoi regions, of the newest point only and all; by Johnson's algorithm; by signed volumes.
std::unique_ptr<NarrowSubject> makeVoronoiSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeFullVoronoiSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeJohnsonSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeSignedVolumesSolver(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCcdNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeFclNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCoalNarrow(const NarrowRequest& request);
}  // namespace CULLET_PRECISION
}  // namespace cullet
