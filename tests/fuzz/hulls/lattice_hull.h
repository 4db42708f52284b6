// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/hull/posed_hull.h"
#include "cullet/tests/fuzz/hulls/lattice_oracle.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::test
{
/// Points and a pose in whole multiples of a power of two, so that float holds every coordinate exactly.
struct LatticeHull
{
    static constexpr std::size_t kMostPoints = 12;

    LatticePoints grid;             ///< components from -8 to 8
    std::uint32_t exponent = 3;     ///< at most 5; the points are grid * 2^exponent
    std::uint32_t orientation = 0;  ///< below 48: a permutation of the axes, and three signs
    Lattice origin = {};            ///< components of at most 2^11

    /// The points in the frame of the hull.
    LatticePoints points() const
    {
        LatticePoints scaled = grid;
        for (Lattice& point : scaled)
        {
            for (std::int64_t& component : point)
                component *= std::int64_t(1) << exponent;
        }
        return scaled;
    }

    /// Columns of the basis by row: row i takes component axes()[i].
    std::array<std::size_t, 3> axes() const
    {
        static constexpr std::array<std::size_t, 3> kPermutations[6] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                                                        {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
        return kPermutations[orientation / 8];
    }

    std::int64_t sign(std::size_t row) const { return (orientation >> row & 1u) != 0 ? -1 : 1; }

    LatticePoints placed() const
    {
        LatticePoints world;
        for (const Lattice& point : points())
        {
            Lattice& moved = world.emplace_back(origin);
            for (std::size_t row = 0; row < 3; ++row)
                moved[row] += sign(row) * point[axes()[row]];
        }
        return world;
    }
};

/// A LatticeHull in the precision of a query.
template <class S>
class TypedHull
{
public:
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// @param unit a power of two: the length of a step of the lattice
    TypedHull(const LatticeHull& lattice, double unit)
        : m_points(convert(lattice.points(), unit)), m_hull(makeHull(m_points, HullExtra::Hierarchy))
    {
        for (std::size_t row = 0; row < 3; ++row)
            m_basis(static_cast<int>(row), static_cast<int>(lattice.axes()[row])) = S(lattice.sign(row));
        m_origin = toVector(lattice.origin, unit);
    }

    const std::vector<Vector>& points() const { return m_points; }
    const Hull<S>& hull() const { return m_hull; }
    PosedHull<S> posed() const { return {m_hull, m_basis, m_origin}; }
    PosedHull<S> posedAt(const Vector& shift) const { return {m_hull, m_basis, m_origin + shift}; }

    static Vector toVector(const Lattice& point, double unit)
    {
        const auto at = [&](std::size_t i) { return static_cast<S>(static_cast<double>(point[i]) * unit); };
        return {at(0), at(1), at(2)};
    }

private:
    static std::vector<Vector> convert(const LatticePoints& points, double unit)
    {
        std::vector<Vector> converted;
        for (const Lattice& point : points)
            converted.push_back(toVector(point, unit));
        return converted;
    }

    std::vector<Vector> m_points;
    Hull<S> m_hull;
    Eigen::Matrix<S, 3, 3> m_basis = Eigen::Matrix<S, 3, 3>::Zero();
    Vector m_origin;
};
}  // namespace cullet::test
