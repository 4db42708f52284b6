// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"
#include "cullet/demos/scenes/exact_pairs.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A broad phase in a benchmark, fed with rows of float boxes. Rows are created in order from 0.
///
/// Only the members marked "timed" may be expensive to the result: they do what a user pays for, and nothing else.
class Subject
{
public:
    virtual ~Subject() = default;

    /// Appends bodies. Timed.
    virtual void create(const Aabb* boxes, std::size_t count) = 0;

    /// Hands over the boxes of these rows. Timed.
    virtual void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) = 0;

    /// Removes one body. Timed.
    virtual void remove(std::uint32_t row) = 0;

    /// Brings the pairs up to date. Timed.
    virtual void findPairs() = 0;

    /// The pairs that overlap exactly now, by row; not timed.
    ///
    /// @param boxes as handed over last
    virtual PairDigest digest(const std::vector<Aabb>& boxes) = 0;

    /// Called after findPairs() and outside of the timing, for bookkeeping of the benchmark's own.
    virtual void settle() {}

    /// Frees what settle() has gathered, and whatever else no user of the broad phase has; the subject is of no use
    /// afterwards. Makes the memory that the subject itself holds measurable.
    virtual void releaseBookkeeping() {}

    /// Pairs held: a margin or laziness may keep more than overlap.
    virtual std::uint64_t heldPairs() = 0;

    virtual int threads() const = 0;

    /// Which way the last update took, for backends that have several; may be empty.
    virtual std::string path() const = 0;

    /// What the last update counted; zeros for those that are measured through Bullet.
    virtual BackendStats counters() const { return {}; }
};

/// Where the measured interface is.
enum class Through
{
    Backend,  ///< proxy table and Backend::update: arrays of boxes in, deltas out
    Bullet  ///< btBroadphaseInterface: setAabb for each box, calculateOverlappingPairs, the pair cache included
};

struct SubjectInfo
{
    const char* name;
    const char* summary;
    bool
        hasBackend;  ///< exists without Bullet; the others are measured through Bullet always, but for rivals
    const char* package = nullptr;  ///< a rival: another library's broad phase; where to get that
    bool isBuilt = true;            ///< false: this program was built without it
};

const std::vector<SubjectInfo>& subjectNames();

struct SubjectRequest
{
    std::string name;
    Through through = Through::Backend;
    int threads = 0;  ///< 0: as many as the machine has
    float margin =
        0.05f;  ///< of the interface to backends; Bullet's default, so that both interfaces do the same work
    std::uint32_t bodies = 0;
    ExactBox bounds;  ///< that no box ever leaves
};

/// Whether this is another library's broad phase (demos/rivals), which has an interface of its own.
bool isRival(const std::string& name);

/// Whether such a subject would be measured through Bullet.
bool isThroughBullet(const SubjectRequest& request);

/// Makes a subject.
///
/// @throws std::invalid_argument for an unknown name, listing the known ones; std::runtime_error when it cannot run here
std::unique_ptr<Subject> makeSubject(const SubjectRequest& request);

std::unique_ptr<Subject> makeBackendSubject(const SubjectRequest& request);
std::unique_ptr<Subject> makeBulletSubject(const SubjectRequest& request);
std::unique_ptr<Subject> makeRivalSubject(const SubjectRequest& request);
}  // namespace CULLET_PRECISION
}  // namespace cullet
