// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/core/sequence_hash.h"

#include <LinearMath/btTransform.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether a pair with a compound had no contacts in the poses and with the shapes of its last call. The same call would
/// create no algorithm, destroy none and find no contact, so that a Dispatcher leaves it out.
///
/// Poses and shapes are compared by hashes of 64 bits. A pair that moves pays for the hash of its poses only: its shapes
/// are hashed, and its manifolds read, once it has not moved from one dispatch to the next.
class CompoundRest
{
    enum class State : std::uint8_t
    {
        Unknown,
        Examined,  ///< by the next call
        Apart,
        Touching
    };

public:
    /// Compares the poses with those of the last dispatch. @return whether they are the same
    bool isUnmoved(const btTransform& a, const btTransform& b) noexcept
    {
        SequenceHash poses;
        poses.add(a);
        poses.add(b);
        if (poses.value() == m_poses)
            return true;
        m_poses = poses.value();
        m_state = State::Unknown;
        return false;
    }
    /// Whether an unmoved pair has no contacts. @param shapes hash of both
    bool isApart(std::uint64_t shapes) const noexcept
    {
        return m_state == State::Apart && m_shapes == shapes;
    }
    /// Whether it is known that it has some.
    bool isTouching(std::uint64_t shapes) const noexcept
    {
        return m_state == State::Touching && m_shapes == shapes;
    }
    /// Lets the next call find out whether the pair has contacts.
    void examine(std::uint64_t shapes) noexcept
    {
        m_shapes = shapes;
        m_state = State::Examined;
    }
    void forget() noexcept { m_state = State::Unknown; }

    /// One call of the algorithm. If it throws, nothing is known afterwards.
    class Call
    {
    public:
        explicit Call(CompoundRest& rest) noexcept : m_rest(rest), m_before(rest.m_state) { rest.forget(); }
        /// @param hasContacts called if the pair is examined: whether there are any
        template <class HasContacts>
        void end(const HasContacts& hasContacts)
        {
            // What was apart is not called by a dispatch, but maybe by the application, with other poses.
            if (m_before == State::Examined)
                m_rest.m_state = hasContacts() ? State::Touching : State::Apart;
            else if (m_before == State::Touching)
                m_rest.m_state = State::Touching;
        }

    private:
        CompoundRest& m_rest;
        const State m_before;
    };

private:
    std::uint64_t m_poses = 0, m_shapes = 0;
    State m_state = State::Unknown;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
