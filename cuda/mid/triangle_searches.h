// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/cuda/mid/mesh_tree_on.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::triangles
{
/// Trees of meshes, and a search for pairs of their triangles, on an executor.
///
/// @tparam Exec psap::HostExec or psap::CudaExec, which has to live as long
template <class Exec>
class TriangleSearches
{
public:
    TriangleSearches(Exec& exec, std::uint32_t trees) : m_exec(exec), m_none(exec)
    {
        for (std::uint32_t i = 0; i < trees; ++i)
            m_trees.push_back(std::make_unique<MeshTreeOn<Exec>>(exec));
    }

    std::uint32_t trees() const { return static_cast<std::uint32_t>(m_trees.size()); }

    /// Launches the steps of a tree, after those of a search that is still to be completed. Does nothing for a tree that
    /// there is not.
    void build(std::uint32_t tree, const DeviceTriangles& mesh)
    {
        complete();
        if (tree < trees())
            m_trees[tree]->build(m_exec, mesh);
    }
    void refit(std::uint32_t tree, const DeviceTriangles& mesh)
    {
        complete();
        if (tree < trees())
            m_trees[tree]->refit(m_exec, mesh);
    }

    /// Launches a search, which replaces the last one.
    void launchPairs(std::uint32_t a, std::uint32_t b) { launch({a, b, false, OwnPairs::All}); }
    void launchOwnPairs(std::uint32_t tree, OwnPairs which) { launch({tree, tree, true, which}); }

    /// Waits for the search; repeats it if the list was too short, and sorts its pairs.
    DeviceTrianglePairs collect()
    {
        complete();
        return {m_pairs.data(), m_count, m_invalid};
    }

    /// Empties all trees and drops the search, also after a failure.
    void forget()
    {
        for (auto& tree : m_trees)
            tree->forget();
        m_isPending = false;
        m_count = m_invalid = 0;
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    struct Search
    {
        std::uint32_t a, b;
        bool isOwn;  ///< of one tree with itself
        OwnPairs which;
    };

    /// The list grows to what it has to hold; this is its first length.
    static constexpr std::uint64_t kFirstRoom = 1024;

    void launch(const Search& search)
    {
        m_isPending = false;
        m_count = m_invalid = 0;
        m_search = search;
        m_exec.reserve(m_found, 1);
        m_exec.reserve(m_fetched, 1);
        m_exec.reserve(m_fetchedInvalid, 2);
        m_exec.reserve(m_pairs, std::max<std::uint64_t>(kFirstRoom, treeOfA().size()));
        find();
        fetchInvalid(treeOfA(), m_fetchedInvalid.data());
        fetchInvalid(treeOfB(), m_fetchedInvalid.data() + 1);
        m_exec.mark();
        m_isPending = true;
    }

    void find()
    {
        m_exec.clear(m_found.data(), 1);
        const psap::PairList list = {m_pairs.data(), m_pairs.size(), m_found.data()};
        const std::uint32_t leaves = treeOfA().size();
        if (m_search.isOwn)
            m_exec.forEachAppend(leaves, OwnPairStep{treeOfA().view(), treeOfA().reader(), m_search.which},
                                 list);
        else
            m_exec.forEachAppend(leaves, TreePairStep{treeOfA().view(), treeOfB().view()}, list);
        m_exec.download(m_fetched.data(), m_found.data(), 1);
    }

    void fetchInvalid(const MeshTreeOn<Exec>& tree, std::uint32_t* to)
    {
        if (tree.size() != 0)
            m_exec.download(to, tree.invalid(), 1);
    }

    void complete()
    {
        if (!m_isPending)
            return;
        m_exec.awaitMark();
        const std::uint64_t count = *m_fetched.data();
        if (count > m_pairs.size())
        {
            m_exec.reserve(m_pairs, count);
            find();
        }
        sort(count);
        m_exec.wait();
        m_isPending = false;
        m_count = count;
        m_invalid = invalidOf(treeOfA(), 0) + (m_search.isOwn ? 0 : invalidOf(treeOfB(), 1));
    }

    std::uint64_t invalidOf(const MeshTreeOn<Exec>& tree, int place) const
    {
        return tree.size() != 0 ? m_fetchedInvalid.data()[place] : 0;
    }

    /// By a number of as few bits as the trees need, in as few passes.
    void sort(std::uint64_t count)
    {
        if (count < 2)
            return;
        m_exec.reserve(m_keys, count);
        m_exec.reserve(m_sortedKeys, count);
        const int bitsOfB = bitsFor(treeOfB());
        m_exec.forEach(count, KeyStep{m_pairs.data(), m_keys.data(), bitsOfB});
        m_exec.sortKeys(m_keys.data(), m_sortedKeys.data(), count, bitsFor(treeOfA()) + bitsOfB);
        m_exec.forEach(count, PairOfKeyStep{m_sortedKeys.data(), m_pairs.data(), bitsOfB});
    }

    static int bitsFor(const MeshTreeOn<Exec>& tree)
    {
        return std::max(1, static_cast<int>(bitWidthOf(tree.size() - 1)));
    }

    const MeshTreeOn<Exec>& treeOfA() const { return treeAt(m_search.a); }
    const MeshTreeOn<Exec>& treeOfB() const { return treeAt(m_search.b); }
    const MeshTreeOn<Exec>& treeAt(std::uint32_t tree) const
    {
        return tree < trees() ? *m_trees[tree] : m_none;
    }

    Exec& m_exec;
    MeshTreeOn<Exec> m_none;  ///< stays empty
    std::vector<std::unique_ptr<MeshTreeOn<Exec>>> m_trees;
    Search m_search = {};
    bool m_isPending = false;  ///< launched, and not yet completed
    std::uint64_t m_count = 0, m_invalid = 0;
    Buffer<RowPair> m_pairs;
    Buffer<std::uint64_t> m_keys, m_sortedKeys;
    Buffer<std::uint64_t> m_found;  ///< number of pairs, also above the length of the list
    typename Exec::template Staging<std::uint64_t> m_fetched;
    typename Exec::template Staging<std::uint32_t> m_fetchedInvalid;
};
}  // namespace cullet::triangles
