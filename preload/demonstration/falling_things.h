// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

/// Initial position of a falling body above a floor at z = 0: a grid of 8 by 8 with as many layers as needed; metres.
struct Place
{
    explicit Place(int i) : x(0.9 * (i % 8)), y(0.9 * (i / 8 % 8)), z(0.4 + 0.7 * (i / 64)) {}
    double x, y, z;
};

/// The output of the programs: a hash of the bits of all positions, and the positions themselves.
class Result
{
public:
    void add(double x, double y, double z)
    {
        for (const double value : {x, y, z})
        {
            m_positions.push_back(value);
            std::uint64_t bits = 0;
            std::memcpy(&bits, &value, sizeof(value));
            m_hash = (m_hash ^ bits) * 1099511628211ull;
        }
    }
    void print() const
    {
        std::printf("hash %016llx\n", static_cast<unsigned long long>(m_hash));
        for (std::size_t i = 0; i < m_positions.size(); i += 3)
            std::printf("at %.9f %.9f %.9f\n", m_positions[i], m_positions[i + 1], m_positions[i + 2]);
    }

private:
    std::uint64_t m_hash = 14695981039346656037ull;
    std::vector<double> m_positions;
};
