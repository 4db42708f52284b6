// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/abi/box_set.h"

#include "cullet/abi/status.h"
#include "cullet/python/native/arrays.h"
#include "cullet/python/native/bindings.h"

#include <cstring>
#include <mutex>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <tuple>
#include <utility>

namespace cullet::python
{
namespace
{
using abi::BoxArray;
using abi::CornerArray;
using IdArray = nb::ndarray<nb::numpy, std::uint32_t>;

CornerArray cornersOf(const NumberArray& array, std::ptrdiff_t firstAxis)
{
    return {array.data() + firstAxis * array.stride(1), array.stride(0), array.stride(1), array.isDouble()};
}

/// The boxes of an array of n x 6 numbers, or of two of n x 3.
class Boxes
{
public:
    /// @param max invalid: `min` has both corners
    Boxes(const AnyArray& min, const AnyArray& max)
        : m_min(min, max.is_valid() ? "min" : "boxes"), m_max(max.is_valid() ? max : min, "max")
    {
        m_isJoined = !max.is_valid();
        m_min.requireRowsOf(m_isJoined ? 6 : 3, m_isJoined ? "boxes" : "min");
        m_max.requireRowsOf(m_isJoined ? 6 : 3, m_isJoined ? "boxes" : "max");
        if (m_min.shape(0) != m_max.shape(0))
            throw nb::value_error("boxes: as many rows of min as of max expected");
    }

    std::uint32_t count() const { return static_cast<std::uint32_t>(m_min.shape(0)); }

    BoxArray array() const
    {
        const bool isPacked = m_isJoined && !m_min.isDouble() && m_min.stride(1) == sizeof(float) &&
                              m_min.stride(0) >= static_cast<std::ptrdiff_t>(sizeof(Aabb));
        if (isPacked)
            return {reinterpret_cast<const float*>(m_min.data()), static_cast<std::size_t>(m_min.stride(0))};
        return {cornersOf(m_min, 0), cornersOf(m_max, m_isJoined ? 3 : 0)};
    }

private:
    NumberArray m_min;
    NumberArray m_max;
    bool m_isJoined;
};

/// A copy of pairs, since the set uses its memory again in the next update.
class PairCopy
{
public:
    void take(const Pairs& pairs)
    {
        static_assert(sizeof(Pair) == 2 * sizeof(std::uint32_t));
        m_count = pairs.size();
        m_ids.reset(new std::uint32_t[2 * m_count]);
        if (m_count > 0)
            std::memcpy(m_ids.get(), pairs.data(), m_count * sizeof(Pair));
    }

    IdArray toArray() { return toNumpy(std::move(m_ids), {m_count, 2}); }

private:
    std::unique_ptr<std::uint32_t[]> m_ids;
    std::size_t m_count = 0;
};

/// A BoxSet for any thread of Python: a call waits until that of another thread is over.
class SharedBoxSet
{
public:
    SharedBoxSet(const std::string& backend, std::int32_t threads, double margin)
        : m_set(makeBackend(backend, abi::checkedThreads(threads)), threads, abi::checkedMargin(margin), 0)
    {
        abi::require(margin >= 0, CULLET_ERROR_ARGUMENT, "margin: not negative and no NaN expected");
    }

    IdArray add(const AnyArray& min, const AnyArray& max)
    {
        const Boxes boxes(min, max);
        std::unique_ptr<std::uint32_t[]> ids(new std::uint32_t[boxes.count()]);
        withoutPython([&] { m_set.add(boxes.array(), boxes.count(), ids.get()); });
        return toNumpy(std::move(ids), {boxes.count()});
    }

    void move(const AnyArray& ids, const AnyArray& min, const AnyArray& max)
    {
        const Boxes boxes(min, max);
        const std::vector<std::uint32_t> known = readIndices(ids, 0, "ids");
        if (known.size() != boxes.count())
            throw nb::value_error("ids: as many as boxes expected");
        withoutPython([&] { m_set.move(known.data(), boxes.array(), boxes.count()); });
    }

    void setFilters(const AnyArray& ids, const AnyArray& groups, const AnyArray& masks)
    {
        const std::vector<std::uint32_t> known = readIndices(ids, 0, "ids");
        const std::vector<std::int32_t> group = readWords(groups, "groups"), mask = readWords(masks, "masks");
        if (group.size() != known.size() || mask.size() != known.size())
            throw nb::value_error("groups, masks: as many as ids expected");
        std::vector<cullet_filter> filters;
        for (std::size_t i = 0; i < known.size(); ++i)
            filters.push_back({group[i], mask[i]});
        withoutPython(
            [&]
            { m_set.setFilters(known.data(), filters.data(), static_cast<std::uint32_t>(filters.size())); });
    }

    void remove(const AnyArray& ids)
    {
        const std::vector<std::uint32_t> known = readIndices(ids, 0, "ids");
        withoutPython([&] { m_set.remove(known.data(), static_cast<std::uint32_t>(known.size())); });
    }

    std::tuple<IdArray, IdArray> update()
    {
        PairCopy added, removed;
        withoutPython(
            [&]
            {
                m_set.update();
                added.take(m_set.delta().added);
                removed.take(m_set.delta().removed);
            });
        return {added.toArray(), removed.toArray()};
    }

    IdArray pairs()
    {
        PairCopy pairs;
        withoutPython([&] { pairs.take(m_set.pairs()); });
        return pairs.toArray();
    }

    /// Boxes, pairs, bytes and the backend's name.
    std::tuple<std::uint32_t, std::uint64_t, std::uint64_t, std::string> stats()
    {
        cullet_box_set_stats stats{};
        withoutPython([&] { m_set.fill(stats); });
        return {stats.boxes, stats.pairs, stats.bytes, stats.backend};
    }

private:
    static std::unique_ptr<Backend> makeBackend(const std::string& name, int threads)
    {
        if (name == "brute")
            return makeBruteForceBackend();
        abi::require(name == "grid", CULLET_ERROR_ARGUMENT, "backend: 'grid' or 'brute' expected");
        GridOptions options;
        options.threads = threads;
        return makeGridBackend(options);
    }

    /// Other threads of Python go on, and this one waits for those that are inside.
    template <class Body>
    void withoutPython(const Body& body)
    {
        const nb::gil_scoped_release released;
        const std::lock_guard<std::mutex> lock(m_mutex);
        body();
    }

    std::mutex m_mutex;
    abi::BoxSet m_set;
};
}  // namespace

void bindBoxSet(nb::module_& module)
{
    nb::class_<SharedBoxSet>(module, "BoxSet", "What cullet.BoxSet hands its arrays to.")
        .def(nb::init<const std::string&, std::int32_t, double>(), nb::arg("backend"), nb::arg("threads"),
             nb::arg("margin"))
        .def("add", &SharedBoxSet::add, nb::arg("min"), nb::arg("max").none())
        .def("move", &SharedBoxSet::move, nb::arg("ids"), nb::arg("min"), nb::arg("max").none())
        .def("set_filters", &SharedBoxSet::setFilters, nb::arg("ids"), nb::arg("groups"), nb::arg("masks"))
        .def("remove", &SharedBoxSet::remove, nb::arg("ids"))
        .def("update", &SharedBoxSet::update)
        .def("pairs", &SharedBoxSet::pairs)
        .def("stats", &SharedBoxSet::stats);
}
}  // namespace cullet::python
