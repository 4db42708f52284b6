// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/huge_vector.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/core/unique_id_map.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// For every proxy a list of its pairs, as links between the entries of a pair array.
///
/// Pair i owns the nodes 2i (in the list of its first proxy) and 2i + 1 (of its second). Lists are circular and doubly
/// linked, with an anchor (sentinel) node per proxy with pairs, most recent pair first, so that removing and moving
/// pairs needs neither special cases nor a search; only adding looks up the anchors by unique id. 16 bytes per pair,
/// 12 per proxy with pairs and the directory's pages.
class PairLinks
{
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;
    /// One bit of a node reference distinguishes anchors from pairs.
    static constexpr std::uint32_t kMaxPairs = 1u << 30;

    struct Anchors
    {
        std::uint32_t first;
        std::uint32_t second;
    };

    static std::uint32_t pairOf(std::uint32_t node) noexcept { return node / 2; }

    /// First node of the proxy's list, or kNone.
    std::uint32_t first(std::uint32_t id) const noexcept
    {
        const std::uint32_t anchor = m_directory.find(id);
        return anchor != UniqueIdMap::kNoRow ? next(kAnchorBit | anchor) : kNone;
    }

    /// Next node of the list, or kNone after the last one.
    std::uint32_t next(std::uint32_t node) const noexcept
    {
        const std::uint32_t after = at(node).next;
        return isAnchor(after) ? kNone : after;
    }

    /// Prefetches the pair's nodes; once they are cached, prefetchNeighbours() prefetches the nodes linked to them.
    [[gnu::always_inline]] void prefetch(std::uint32_t pair) const noexcept
    {
        __builtin_prefetch(&m_nodes[2 * std::size_t{pair}]);
    }
    [[gnu::always_inline]] void prefetchNeighbours(std::uint32_t pair) const noexcept
    {
        for (const Node& node : {m_nodes[2 * pair], m_nodes[2 * pair + 1]})
        {
            __builtin_prefetch(&at(node.next));
            __builtin_prefetch(&at(node.previous));
        }
    }

    // Three stages of a search for the first node of a proxy's list: each reads what the one before it prefetched.
    [[gnu::always_inline]] void prefetchId(std::uint32_t id) const noexcept { m_directory.prefetch(id); }
    [[gnu::always_inline]] void prefetchAnchor(std::uint32_t id) const noexcept
    {
        const std::uint32_t anchor = m_directory.find(id);
        if (anchor != UniqueIdMap::kNoRow)
            __builtin_prefetch(&m_anchors[anchor]);
    }
    [[gnu::always_inline]] void prefetchFirst(std::uint32_t id) const noexcept
    {
        const std::uint32_t node = first(id);
        if (node != kNone)
            __builtin_prefetch(&m_nodes[node]);
    }

    std::size_t capacity() const noexcept { return m_nodes.capacity() / 2; }

    /// Reserves memory for a number of pairs. May throw std::bad_alloc and then changes nothing.
    void reserve(std::size_t pairCount) { m_nodes.reserve(2 * pairCount); }

    /// The anchors of both lists, created if necessary. May throw std::bad_alloc and then changes nothing. Valid until
    /// a pair is detached, or an anchor dropped.
    Anchors anchorsOf(Pair ids)
    {
        const std::uint32_t first = m_directory.find(ids.first), second = m_directory.find(ids.second);
        if (first != UniqueIdMap::kNoRow && second != UniqueIdMap::kNoRow)
            return {first | kAnchorBit, second | kAnchorBit};
        return makeAnchors(ids);
    }

    /// Frees an anchor that anchorsOf() created for a pair that was not added, if the proxy has no pair.
    void dropIfUnused(std::uint32_t id) noexcept
    {
        const std::uint32_t anchor = m_directory.find(id);
        if (anchor != UniqueIdMap::kNoRow && isAnchor(m_anchors[anchor].next))
            drop(id, anchor);
    }

    /// Links a new last pair at the front of both lists. @pre capacity() is above the number of pairs
    void append(Anchors anchors) noexcept
    {
        const auto node = static_cast<std::uint32_t>(m_nodes.size());
        m_nodes.resize(node + 2);
        pushFront(anchors.first, node);
        pushFront(anchors.second, node + 1);
    }

    /// Unlinks the pair from both lists; its entry stays.
    void detach(std::uint32_t pair, Pair ids) noexcept
    {
        unlink(m_nodes[2 * pair], ids.first);
        unlink(m_nodes[2 * pair + 1], ids.second);
    }

    /// Moves the nodes of the linked pair `from` to the detached entry `to`.
    void move(std::uint32_t from, std::uint32_t to) noexcept
    {
        relink(2 * from, 2 * to);
        relink(2 * from + 1, 2 * to + 1);
    }

    void popBack() noexcept { m_nodes.resize(m_nodes.size() - 2); }

    /// Keeps a number of pairs. @pre the others are detached
    void truncate(std::uint32_t pairs) noexcept { m_nodes.resize(2 * std::size_t{pairs}); }

    /// Removes all pairs and keeps the anchors. @pre no pair is detached
    void clear() noexcept
    {
        for (const Node& node : m_nodes)
        {
            if (isAnchor(node.previous))
                at(node.previous) = {node.previous, node.previous};
        }
        m_nodes.clear();
    }

    /// Removes all pairs and their anchors, and keeps the memory but for the directory's. O(ids of the directory's pages).
    void removeAll() noexcept
    {
        m_nodes.clear();
        m_anchors.clear();
        m_directory.clear();
        m_firstFree = kNone;
        m_freeCount = 0;
    }

    /// Whether each of `pairCount` pairs is in exactly the lists of its ids, `idsOf(pair)`. O(pairs).
    template <class IdsOf>
    bool isConsistent(std::uint32_t pairCount, IdsOf idsOf) const
    {
        if (m_nodes.size() != 2 * std::size_t{pairCount})
            return false;
        std::size_t listed = 0;
        for (std::uint32_t start = 0; start < m_nodes.size(); ++start)
        {
            if (!isAnchor(m_nodes[start].previous))
                continue;
            const auto idOf = [&](std::uint32_t node)
            {
                const Pair ids = idsOf(pairOf(node));
                return node % 2 == 0 ? ids.first : ids.second;
            };
            if (first(idOf(start)) != start)
                return false;
            std::uint32_t previous = m_nodes[start].previous;
            for (std::uint32_t node = start; node != kNone; previous = node, node = next(node))
            {
                if (at(node).previous != previous || idOf(node) != idOf(start))
                    return false;
                if (++listed > m_nodes.size())
                    return false;
            }
        }
        return listed == m_nodes.size();
    }

    std::uint64_t listCount() const noexcept { return m_anchors.size() - m_freeCount; }

    std::uint64_t bytes() const noexcept
    {
        return m_nodes.capacity() * sizeof(Node) + m_anchors.capacity() * sizeof(Node) + m_directory.bytes();
    }

private:
    struct Node
    {
        std::uint32_t next;
        std::uint32_t previous;
    };

    static constexpr std::uint32_t kAnchorBit = 1u << 31;

    Node& at(std::uint32_t node) noexcept { return const_cast<Node&>(std::as_const(*this).at(node)); }
    const Node& at(std::uint32_t node) const noexcept
    {
        // Both addresses are computed, so that no branch depends on the link.
        const Node* nodes[] = {m_nodes.data(), m_anchors.data()};
        return nodes[node / kAnchorBit][node % kAnchorBit];
    }

    static bool isAnchor(std::uint32_t node) noexcept { return (node & kAnchorBit) != 0; }

    std::uint32_t anchorOf(std::uint32_t id)
    {
        std::uint32_t anchor = m_directory.find(id);
        if (anchor == UniqueIdMap::kNoRow)
            anchor = makeAnchor(id);
        return anchor | kAnchorBit;
    }

    [[gnu::noinline]] Anchors makeAnchors(Pair ids)
    {
        const std::uint64_t before = listCount();
        const std::uint32_t first = anchorOf(ids.first);
        try
        {
            return {first, anchorOf(ids.second)};
        }
        catch (...)
        {
            if (listCount() != before)
                dropIfUnused(ids.first);
            throw;
        }
    }

    std::uint32_t makeAnchor(std::uint32_t id)
    {
        if (m_freeCount == 0)
        {
            m_anchors.push_back({kNone, kNone});
            freeAnchor(static_cast<std::uint32_t>(m_anchors.size() - 1));
        }
        const std::uint32_t anchor = m_firstFree;
        m_directory.insert(id, anchor);
        m_firstFree = m_anchors[anchor].next;
        --m_freeCount;
        m_anchors[anchor] = {anchor | kAnchorBit, anchor | kAnchorBit};
        return anchor;
    }

    void drop(std::uint32_t id, std::uint32_t anchor) noexcept
    {
        m_directory.erase(id);
        freeAnchor(anchor);
    }

    void freeAnchor(std::uint32_t anchor) noexcept
    {
        m_anchors[anchor].next = m_firstFree;
        m_firstFree = anchor;
        ++m_freeCount;
    }

    void pushFront(std::uint32_t anchor, std::uint32_t node) noexcept
    {
        const std::uint32_t old = at(anchor).next;
        m_nodes[node] = {old, anchor};
        at(old).previous = node;
        at(anchor).next = node;
    }

    void unlink(Node node, std::uint32_t id) noexcept
    {
        at(node.next).previous = node.previous;
        at(node.previous).next = node.next;
        if (node.next == node.previous)  // only the anchor is left in the list
            drop(id, node.next & ~kAnchorBit);
    }

    void relink(std::uint32_t from, std::uint32_t to) noexcept
    {
        const Node node = m_nodes[from];
        m_nodes[to] = node;
        at(node.next).previous = to;
        at(node.previous).next = to;
    }

    HugeVector<Node> m_nodes;
    HugeVector<Node> m_anchors;
    UniqueIdMap m_directory;            // unique id -> anchor
    std::uint32_t m_firstFree = kNone;  // free anchors are linked by `next`
    std::uint32_t m_freeCount = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
