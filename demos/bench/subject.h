// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"
#include "cullet/comparison/comparison_stats.h"
#include "cullet/demos/scenes/exact_pairs.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A broad phase in a benchmark, which receives rows of float boxes. Rows are created in order from 0.
///
/// The members marked "timed" do exactly the work that a user of the broad phase pays for; the other members are
/// outside of the timing.
class Subject
{
public:
    virtual ~Subject() = default;

    /// Appends bodies. Timed.
    virtual void create(const Aabb* boxes, std::size_t count) = 0;

    /// Sets the boxes of these rows. Timed.
    virtual void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) = 0;

    /// Removes one body. Timed.
    virtual void remove(std::uint32_t row) = 0;

    /// Brings the pairs up to date. Timed.
    virtual void findPairs() = 0;

    /// The pairs that overlap exactly now, by row; not timed.
    ///
    /// @param boxes the boxes last set
    virtual PairDigest digest(const std::vector<Aabb>& boxes) = 0;

    /// Called after findPairs() and outside of the timing, for bookkeeping of the benchmark.
    virtual void settle() {}

    /// Frees the data gathered by settle(), and all other memory that is not the broad phase's, so that the memory of
    /// the broad phase can be measured. The subject is unusable afterwards.
    virtual void releaseBookkeeping() {}

    /// Held pairs; a margin or lazy removal may keep more than the overlapping ones.
    virtual std::uint64_t heldPairs() = 0;

    virtual int threads() const = 0;

    /// The path that the last update took, for backends with several; may be empty.
    virtual std::string path() const = 0;

    /// Counters of the last update; zeros for subjects measured through Bullet.
    virtual BackendStats counters() const { return {}; }
    virtual ComparisonStats comparisonCounters() const { return {}; }
};

/// The measured interface.
enum class Through
{
    Backend,  ///< proxy table and Backend::update: arrays of boxes in, deltas out
    Bullet  ///< btBroadphaseInterface: setAabb for each box, calculateOverlappingPairs, the pair cache included
};

struct SubjectInfo
{
    const char* name;
    const char* summary;
    bool hasBackend;                ///< else measured through Bullet, except rivals
    const char* package = nullptr;  ///< for a rival, another library's broad phase: where to get it
    bool isBuilt = true;            ///< false: this program was built without it
};

const std::vector<SubjectInfo>& subjectNames();

struct SubjectRequest
{
    std::string name;
    Through through = Through::Backend;
    int threads = 0;       ///< 0: as many as the machine has
    float margin = 0.05f;  ///< for backends; Bullet's default, for equal work
    std::uint32_t bodies = 0;
    ExactBox bounds;  ///< that contain all boxes at all times
};

/// Whether this is another library's broad phase (demos/rivals), which has its own interface.
bool isRival(const std::string& name);

/// Whether the subject is measured through Bullet.
bool isThroughBullet(const SubjectRequest& request);

/// Makes a subject.
///
/// @throws std::invalid_argument for an unknown name, listing the known ones; std::runtime_error if the subject cannot
/// run here
std::unique_ptr<Subject> makeSubject(const SubjectRequest& request);

std::unique_ptr<Subject> makeBackendSubject(const SubjectRequest& request);
std::unique_ptr<Subject> makeBulletSubject(const SubjectRequest& request);
std::unique_ptr<Subject> makeRivalSubject(const SubjectRequest& request);
}  // namespace CULLET_PRECISION
}  // namespace cullet
