// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/abi/hull_batch.h"
#include "cullet/abi/hull_queries.h"
#include "cullet/python/native/arrays.h"
#include "cullet/python/native/bindings.h"
#include "cullet/python/native/poses.h"

#include <algorithm>
#include <new>
#include <string>
#include <utility>

namespace cullet::python
{
namespace
{
using RealArray = nb::ndarray<nb::numpy, double>;

void makeHull(cullet_hull* self, const AnyArray& array)
{
    const NumberArray numbers(array, "points");
    numbers.requireRowsOf(3, "points");
    const std::size_t count = numbers.shape(0);
    std::vector<double> points;
    points.reserve(3 * count);
    for (std::size_t i = 0; i < count; ++i)
    {
        for (std::ptrdiff_t axis = 0; axis < 3; ++axis)
            points.push_back(
                numbers.at(static_cast<std::ptrdiff_t>(i) * numbers.stride(0) + axis * numbers.stride(1)));
    }
    const nb::gil_scoped_release released;
    // An empty vector may have no memory, which would be another error.
    points.reserve(1);
    new (self)
        cullet_hull(std::move(*abi::makeHullHandle(points.data(), 0, static_cast<std::uint32_t>(count))));
}

RealArray verticesOf(const cullet_hull& hull)
{
    const auto count = static_cast<std::size_t>(hull.hull.vertexCount());
    std::unique_ptr<double[]> vertices(new double[3 * count]);
    for (std::size_t i = 0; i < count; ++i)
    {
        const Eigen::Vector3d vertex = hull.hull.vertex(static_cast<std::int32_t>(i));
        std::copy_n(vertex.data(), 3, &vertices[3 * i]);
    }
    return toNumpy(std::move(vertices), {count, 3});
}

/// Hulls and their poses as the C interface has them.
class Bodies
{
public:
    /// @param poses invalid: identity
    /// @param side  "a" or "b", for messages
    Bodies(const nb::tuple& hulls, const AnyArray& poses, const std::string& side)
    {
        m_hulls.reserve(hulls.size());
        for (const nb::handle hull : hulls)
        {
            const cullet_hull* known = nullptr;
            if (!nb::try_cast(hull, known) || known == nullptr)
                throw nb::type_error((side + ": a Hull or a sequence of them expected").c_str());
            m_hulls.push_back(known);
        }
        if (!poses.is_valid())
            return;
        const std::string name = "poses_" + side;
        m_poses = readPoses(poses, name.c_str());
        // One stands for all.
        if (m_hulls.size() == 1)
            m_hulls.resize(m_poses.size(), m_hulls[0]);
        else if (m_poses.size() == 1)
            m_poses.resize(m_hulls.size(), m_poses[0]);
        if (m_hulls.size() != m_poses.size())
            throw nb::value_error((name + ": as many as hulls expected, or one of either").c_str());
    }

    std::size_t count() const { return m_hulls.size(); }

    cullet_bodies view() const
    {
        return {m_hulls.data(), m_poses.empty() ? nullptr : m_poses.data(),
                static_cast<std::uint32_t>(m_hulls.size()), 0};
    }

private:
    std::vector<const cullet_hull*> m_hulls;
    std::vector<cullet_pose> m_poses;
};

/// Pairs without a list: body by body, where one stands for all.
std::size_t countTogether(std::size_t a, std::size_t b)
{
    if (a != b && a != 1 && b != 1)
        throw nb::value_error("as many bodies of a as of b expected, or one of either, or pairs");
    return a == 1 ? b : a;
}

/// What a batch fills: states, and one block of numbers, since each array of NumPy takes a microsecond to make.
class Answers
{
public:
    /// @param hasPoints false: axes alone
    Answers(std::size_t count, bool hasPoints)
        : m_count(count),
          m_columns(hasPoints ? 10 : 3),
          m_states(new std::int32_t[count]),
          m_reals(new double[m_columns * count])
    {
    }

    cullet_hull_results view()
    {
        double* const reals = m_reals.get();
        cullet_hull_results results{};
        results.size = sizeof(results);
        results.states = m_states.get();
        results.axes = reals;
        if (m_columns == 3)
            return results;
        results.points_a = reals + 3 * m_count;
        results.points_b = reals + 6 * m_count;
        results.distances = reals + 9 * m_count;
        return results;
    }

    /// States; and axes, points of A, points of B, distances, one after the other.
    nb::tuple toTuple()
    {
        auto states = toNumpy(std::move(m_states), {m_count});
        return nb::make_tuple(std::move(states), toNumpy(std::move(m_reals), {m_columns * m_count}));
    }

private:
    std::size_t m_count;
    std::size_t m_columns;
    std::unique_ptr<std::int32_t[]> m_states;
    std::unique_ptr<double[]> m_reals;
};

nb::tuple queryHulls(std::int32_t query, const nb::tuple& hullsA, const AnyArray& posesA,
                     const nb::tuple& hullsB, const AnyArray& posesB, const AnyArray& pairs,
                     double maxDistance, std::int32_t threads)
{
    const Bodies a(hullsA, posesA, "a"), b(hullsB, posesB, "b");
    // Copied, since another thread of Python could write into the caller's between their check and their use.
    std::vector<std::uint32_t> indices;
    if (pairs.is_valid())
        indices = readIndices(pairs, 2, "pairs");
    const std::size_t count = pairs.is_valid() ? indices.size() / 2 : countTogether(a.count(), b.count());
    cullet_hull_batch batch{};
    batch.size = sizeof(batch);
    batch.query = query;
    batch.a = a.view();
    batch.b = b.view();
    batch.pairs = pairs.is_valid() ? reinterpret_cast<const cullet_pair*>(indices.data()) : nullptr;
    batch.pair_count = count;
    batch.max_distance = maxDistance;
    batch.threads = threads;
    Answers answers(count, query != CULLET_QUERY_OVERLAP);
    {
        const nb::gil_scoped_release released;
        abi::runHullBatch(batch, answers.view());
    }
    return answers.toTuple();
}
}  // namespace

void bindHulls(nb::module_& module)
{
    nb::class_<cullet_hull>(module, "Hull", "What cullet.Hull derives from.")
        .def("__init__", &makeHull, nb::arg("points"))
        .def_prop_ro(
            "vertex_count", [](const cullet_hull& hull) { return hull.hull.vertexCount(); },
            "Vertices of the hull.")
        .def_prop_ro("vertices", &verticesOf, nb::rv_policy::move,
                     "A copy of the vertices, float64, shape (vertex_count, 3).");
    module.def("query_hulls", &queryHulls, nb::arg("query"), nb::arg("hulls_a"), nb::arg("poses_a").none(),
               nb::arg("hulls_b"), nb::arg("poses_b").none(), nb::arg("pairs").none(),
               nb::arg("max_distance"), nb::arg("threads"));
}
}  // namespace cullet::python
