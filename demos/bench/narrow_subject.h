// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/bench/narrow_trajectories.h"
#include "narrow/support.h"

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

    /// Runs once more and counts; not timed.
    virtual NarrowWork countWork() { return {}; }
};

struct NarrowSubjectInfo
{
    const char* name;
    const char* summary;  ///< or how to get it into this program, if `make` is null
    bool canBeWarm;
    std::unique_ptr<NarrowSubject> (*make)(const NarrowRequest& request);
};

/// All libraries that this program may be built with.
const std::vector<NarrowSubjectInfo>& narrowSubjects();

std::unique_ptr<NarrowSubject> makeCulletNarrow(const NarrowRequest& request);
/// With Chung and Wang's steps before GJK; nullptr but for booleans.
std::unique_ptr<NarrowSubject> makeCulletReflectedNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeBulletNarrow(const NarrowRequest& request);
/// The algorithm of a pair in Bullet's dispatcher: ISA-GJK's, or Bullet's own, which always keeps its manifold.
std::unique_ptr<NarrowSubject> makeAlgorithmNarrow(const NarrowRequest& request, bool isIsaGjk);
/// All pairs of a frame through a dispatcher, on one thread; nullptr for cullet's when cold.
std::unique_ptr<NarrowSubject> makeDispatcherNarrow(const NarrowRequest& request, bool isCullets);
std::unique_ptr<NarrowSubject> makeCcdNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeFclNarrow(const NarrowRequest& request);
std::unique_ptr<NarrowSubject> makeCoalNarrow(const NarrowRequest& request);
}  // namespace CULLET_PRECISION
}  // namespace cullet
