// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_oracle.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::test
{
/// A proxy table, a backend that is updated with it, and the oracle that checks every update.
class BackendSession
{
public:
    explicit BackendSession(std::unique_ptr<Backend> backend) : m_backend(std::move(backend)) {}

    /// Adds a proxy with the next id, or the given one.
    ProxyId add(const Aabb& box, Filter filter = kEverything) { return addWithId(m_nextId++, box, filter); }
    ProxyId addWithId(std::uint32_t uniqueId, const Aabb& box, Filter filter = kEverything)
    {
        return table.create(box, uniqueId, filter);
    }

    /// One update of backend and oracle. Fails unless status is Ok, the deltas are equal, sorted, unique and disjoint,
    /// and the backend counts as many pairs as the oracle.
    testing::AssertionResult step();

    /// Restarts backend and oracle with the same known pairs.
    void restart(const Pairs& known);

    /// Replaces the backend by another one, which starts from the pairs held now.
    void changeBackend(std::unique_ptr<Backend> backend);

    /// Success if the last step reported exactly these changes.
    testing::AssertionResult reported(const Pairs& added, const Pairs& removed) const;

    Pairs pairs() const { return m_oracle.pairs(); }
    const PairDelta& delta() const { return m_delta; }
    Backend& backend() { return *m_backend; }
    std::uint64_t addedTotal() const { return m_addedTotal; }
    std::uint64_t removedTotal() const { return m_removedTotal; }

    ProxyTable table;
    float margin = 0.0f;
    bool useFilter = true;

private:
    std::unique_ptr<Backend> m_backend;
    PairOracle m_oracle;
    PairDelta m_delta;
    std::uint32_t m_nextId = 1;
    std::uint64_t m_addedTotal = 0;
    std::uint64_t m_removedTotal = 0;
};
}  // namespace cullet::test
