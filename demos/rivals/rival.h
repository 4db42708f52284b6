// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/pair.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
/// A broad phase of another library behind one interface, fed with rows of float boxes. Rows are created in order from
/// 0. Its pairs are a complete list in each frame, since none of these libraries reports changes.
class Rival
{
public:
    virtual ~Rival() = default;

    virtual void create(const Aabb* boxes, std::size_t count) = 0;
    virtual void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) = 0;

    /// Removes one body permanently.
    virtual void remove(std::uint32_t row) = 0;

    /// Appends the pairs of rows that the library reports now, each once, in any order.
    virtual void findPairs(Pairs& pairs) = 0;
};

struct RivalRequest
{
    std::string name;
    Aabb bounds;  ///< that contain all boxes at all times
    int threads;  ///< > 0; for libraries that use several
};

struct RivalInfo
{
    const char* name;
    const char* summary;
    const char* package;  ///< where to get the library
    bool hasThreads;
    std::unique_ptr<Rival> (*make)(
        const RivalRequest& request);  ///< null: the library was not found at build time
};

/// Every supported rival, including those that this program was built without.
const std::vector<RivalInfo>& rivals();

/// The rival of that name, or null.
const RivalInfo* findRival(const std::string& name);

/// Expansion of "rivals": those that this program was built with.
std::vector<std::string> builtRivals();

/// Makes a rival.
///
/// @throws std::runtime_error if this program was built without it, naming the package
std::unique_ptr<Rival> makeRival(const RivalRequest& request);

std::unique_ptr<Rival> makeCgalRival(const RivalRequest& request);
std::unique_ptr<Rival> makeCoalRival(const RivalRequest& request);
std::unique_ptr<Rival> makeEmbreeRival(const RivalRequest& request);
std::unique_ptr<Rival> makeFclRival(const RivalRequest& request);
std::unique_ptr<Rival> makeOdeRival(const RivalRequest& request);
}  // namespace cullet
