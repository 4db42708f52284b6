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
/// 0. Its pairs are a fresh list in each frame, since none of these libraries tells what has changed.
class Rival
{
public:
    virtual ~Rival() = default;

    virtual void create(const Aabb* boxes, std::size_t count) = 0;
    virtual void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) = 0;

    /// Takes one body out for good.
    virtual void remove(std::uint32_t row) = 0;

    /// Appends the pairs of rows that the library reports now, each once, in any order.
    virtual void findPairs(Pairs& pairs) = 0;
};

struct RivalRequest
{
    std::string name;
    Aabb bounds;  ///< that no box ever leaves
    int threads;  ///< > 0; for those that have several
};

struct RivalInfo
{
    const char* name;
    const char* summary;
    const char* package;  ///< where to get the library
    bool hasThreads;
    std::unique_ptr<Rival> (*make)(
        const RivalRequest& request);  ///< null: the library was not there at build time
};

/// Every rival that this source knows, also those that this program was built without.
const std::vector<RivalInfo>& rivals();

/// The rival of that name, or null.
const RivalInfo* findRival(const std::string& name);

/// What "rivals" stands for: those that this program was built with.
std::vector<std::string> builtRivals();

/// Makes a rival.
///
/// @throws std::runtime_error when this program was built without it, naming the package
std::unique_ptr<Rival> makeRival(const RivalRequest& request);

std::unique_ptr<Rival> makeCgalRival(const RivalRequest& request);
std::unique_ptr<Rival> makeCoalRival(const RivalRequest& request);
std::unique_ptr<Rival> makeEmbreeRival(const RivalRequest& request);
std::unique_ptr<Rival> makeFclRival(const RivalRequest& request);
std::unique_ptr<Rival> makeOdeRival(const RivalRequest& request);
}  // namespace cullet
