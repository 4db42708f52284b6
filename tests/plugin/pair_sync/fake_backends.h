// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <memory>
#include <vector>

namespace cullet::test
{
/// A brute-force backend that fails in a given update.
class FailingBackend final : public Backend
{
public:
    FailingBackend(int goodUpdates, Status failure) : m_goodUpdates(goodUpdates), m_failure(failure) {}

    Status update(const ProxyView& proxies, PairDelta& delta) override
    {
        if (m_goodUpdates-- > 0)
            return m_inner->update(proxies, delta);
        // Partial results of a failing device must not reach the pair cache.
        delta.added = {{1, 2}, {7, 9}};
        delta.removed = {{1, 3}};
        return m_failure;
    }
    void restart(const Pairs& known) override { m_inner->restart(known); }
    const char* name() const noexcept override { return "failing"; }
    BackendStats stats() const override { return m_inner->stats(); }

private:
    int m_goodUpdates;
    Status m_failure;
    std::unique_ptr<Backend> m_inner = makeBruteForceBackend();
};

/// Counts of a backend's input and output.
struct Traffic
{
    std::uint64_t updates = 0;
    std::uint64_t dirtyRows = 0;
    std::uint64_t restarts = 0;
    bool hadFilters = false;
};

/// Counts the input of the wrapped backend.
class CountingBackend final : public Backend
{
public:
    explicit CountingBackend(Traffic& traffic, std::unique_ptr<Backend> inner = makeBruteForceBackend())
        : m_traffic(traffic), m_inner(std::move(inner))
    {
    }

    Status update(const ProxyView& proxies, PairDelta& delta) override
    {
        ++m_traffic.updates;
        m_traffic.dirtyRows += proxies.dirtyCount;
        m_traffic.hadFilters = proxies.filters != nullptr;
        return m_inner->update(proxies, delta);
    }
    void restart(const Pairs& known) override
    {
        ++m_traffic.restarts;
        m_inner->restart(known);
    }
    const char* name() const noexcept override { return "counting"; }
    BackendStats stats() const override { return m_inner->stats(); }

private:
    Traffic& m_traffic;
    std::unique_ptr<Backend> m_inner;
};
}  // namespace cullet::test
