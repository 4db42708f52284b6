// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/pair.h"
#include "plugin/hash_slots.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// For every proxy the list of the pairs it is in, as links between the entries of a pair array.
///
/// Pair i owns the nodes 2i (in the list of its first proxy) and 2i + 1 (of its second). Lists are doubly linked, the
/// newest pair first. Their heads are found by unique id through a hash of the proxies that have pairs, so that ids may
/// be any 32-bit numbers. 16 bytes per pair and 16 to 24 per proxy with pairs.
class PairLinks
{
public:
    static constexpr std::uint32_t kNone = HashSlots::kNone;

    static std::uint32_t pairOf(std::uint32_t node) noexcept { return node / 2; }

    /// First node of the proxy's list, or kNone.
    std::uint32_t first(std::uint32_t id) const noexcept
    {
        const std::uint32_t hash = hashOfId(id);
        const std::size_t position = m_heads.lowerBound(hash);
        return m_heads.holds(position, hash) ? m_heads.value(position) : kNone;
    }

    std::uint32_t next(std::uint32_t node) const noexcept { return m_nodes[node].next; }
    std::uint32_t previous(std::uint32_t node) const noexcept { return m_nodes[node].previous; }

    bool hasRoom() const noexcept { return m_nodes.size() < m_nodes.capacity() && m_heads.hasRoom(2); }

    /// Room for `pairCount` pairs in all and for the heads of one more. May throw std::bad_alloc; no list changes.
    void reserve(std::size_t pairCount)
    {
        m_nodes.reserve(2 * pairCount);
        m_heads.makeRoom(2);
    }

    /// Links a new last pair in front of the lists of both proxies. @pre hasRoom(); two different ids
    void append(Pair ids) noexcept
    {
        m_nodes.resize(m_nodes.size() + 2);  // within the capacity
        const auto node = static_cast<std::uint32_t>(m_nodes.size() - 2);
        pushFront(node, ids.first);
        pushFront(node + 1, ids.second);
    }

    /// Takes the pair out of both lists; its entry stays, marked as detached.
    void detach(std::uint32_t pair, Pair ids) noexcept
    {
        unlink(m_nodes[2 * pair], ids.first);
        unlink(m_nodes[2 * pair + 1], ids.second);
        m_nodes[2 * pair].next = kDetached;
    }

    bool isDetached(std::uint32_t pair) const noexcept { return m_nodes[2 * pair].next == kDetached; }

    /// Moves the nodes of the linked pair `from` to the detached entry `to`.
    void move(std::uint32_t from, std::uint32_t to, Pair ids) noexcept
    {
        relink(2 * from, 2 * to, ids.first);
        relink(2 * from + 1, 2 * to + 1, ids.second);
    }

    void moveDetached(std::uint32_t to) noexcept { m_nodes[2 * to].next = kDetached; }

    void popBack() noexcept { m_nodes.resize(m_nodes.size() - 2); }

    /// Forgets every pair.
    void clear() noexcept
    {
        m_nodes.clear();
        m_heads.clear();
    }

    void prefetch(std::uint32_t pair) const noexcept { __builtin_prefetch(&m_nodes[2 * pair], 1); }
    void prefetchHead(std::uint32_t id) const noexcept { m_heads.prefetch(hashOfId(id)); }

    void prefetchNode(std::uint32_t node) const noexcept
    {
        if (node < m_nodes.size())
            __builtin_prefetch(&m_nodes[node], 1);
    }

    std::uint64_t listCount() const noexcept { return m_heads.size(); }
    std::uint64_t bytes() const noexcept { return m_nodes.capacity() * sizeof(Node) + m_heads.bytes(); }

private:
    struct Node
    {
        std::uint32_t next;      // kNone: last
        std::uint32_t previous;  // kNone: first
    };

    static constexpr std::uint32_t kDetached =
        kNone - 1;  // above any node: a pair array holds less than 2^31 pairs

    void pushFront(std::uint32_t node, std::uint32_t id) noexcept
    {
        const std::uint32_t hash = hashOfId(id);
        const std::size_t position = m_heads.lowerBound(hash);
        if (!m_heads.holds(position, hash))
        {
            m_nodes[node] = {kNone, kNone};
            m_heads.insert(position, hash, node);
            return;
        }
        const std::uint32_t old = m_heads.value(position);
        m_nodes[node] = {old, kNone};
        m_nodes[old].previous = node;
        m_heads.setValue(position, node);
    }

    void unlink(Node node, std::uint32_t id) noexcept
    {
        if (node.next != kNone)
            m_nodes[node.next].previous = node.previous;
        if (node.previous != kNone)
        {
            m_nodes[node.previous].next = node.next;
            return;
        }
        const std::size_t position = m_heads.lowerBound(hashOfId(id));
        if (node.next != kNone)
        {
            m_heads.setValue(position, node.next);
        }
        else
        {
            m_heads.erase(position);
        }
    }

    void relink(std::uint32_t from, std::uint32_t to, std::uint32_t id) noexcept
    {
        const Node node = m_nodes[from];
        m_nodes[to] = node;
        if (node.next != kNone)
            m_nodes[node.next].previous = to;
        if (node.previous != kNone)
        {
            m_nodes[node.previous].next = to;
        }
        else
        {
            m_heads.setValue(m_heads.lowerBound(hashOfId(id)), to);
        }
    }

    std::vector<Node> m_nodes;
    HashSlots m_heads;  // hash of the id -> first node
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
