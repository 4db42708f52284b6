// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/random.h"

#include <cstdint>
#include <vector>

namespace cullet::test
{
/// Contents of a RandomWorld and probabilities of its operations, per live proxy and step.
struct RandomWorldOptions
{
    std::uint32_t count = 80;    ///< proxies at the start; creation and destruction keep the number near it
    float halfSide = 5.0f;       ///< boxes lie around the origin within this distance
    float shift[3] = {0, 0, 0};  ///< ... or around this point
    int sizeLow = -1;            ///< extents are log-uniform in [2^sizeLow, 2^sizeHigh)
    int sizeHigh = 2;
    float move = 0.3f;  ///< moves by up to `stride` on every axis
    float stride = 0.5f;
    float teleport = 0.02f;
    float resize = 0.02f;
    float refilter = 0.02f;
    float destroy = 0.02f;
    float resend = 0.02f;   ///< setBox() with an unchanged box
    float special = 0.02f;  ///< becomes a point, an inverted box, NaN, or a box without bounds
    std::uint32_t firstId = 1;
    bool isSnapped = true;  ///< coordinates are multiples of 1/16, so that boxes often just touch
};

/// Counts of a RandomWorld's operations; tests assert that no count they rely on is zero.
struct RandomWorldCounts
{
    std::uint64_t moved = 0, teleported = 0, resized = 0, refiltered = 0, created = 0, destroyed = 0,
                  special = 0;
};

/// Random operation sequences on a ProxyTable.
class RandomWorld
{
public:
    RandomWorld(std::uint32_t seed, const RandomWorldOptions& options, ProxyTable& table);

    /// Changes the table at random, as one step of a simulation would.
    void step();

    void createSome(std::uint32_t count);
    void destroyAll();

    const std::vector<ProxyId>& rows() const { return m_rows; }
    const RandomWorldCounts& counts() const { return m_counts; }
    Random& random() { return m_random; }
    RandomWorldOptions options;

private:
    void create();
    void change(std::size_t index);
    Aabb randomBox();
    Aabb specialBox();
    Filter randomFilter();
    float snapped(float value) const;

    ProxyTable& m_table;
    Random m_random;
    std::vector<ProxyId> m_rows;  ///< live rows
    std::uint32_t m_nextId;
    RandomWorldCounts m_counts;
};
}  // namespace cullet::test
