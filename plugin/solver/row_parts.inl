// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// What all loops over blocks have in common: the motions of the bodies, and what a row does to them. Internal linkage.
#include "cullet/plugin/solver/row_kernels.h"
#include "cullet/plugin/solver/wide.inl"

#include <type_traits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// The motions of a block's bodies.
struct PairMotion
{
    Wide3 linearA, angularA, linearB, angularB;
};

[[gnu::always_inline]] inline void readMotion(const SolverMotion* motions, const std::uint32_t* bodies,
                                              Wide3& linear, Wide3& angular)
{
    const btScalar* from[kLanes];
    for (int i = 0; i < kLanes; ++i)
        from[i] = motions[bodies[i]].linear;
    const WideQuad first = WideRecords::read(from);
    for (int i = 0; i < kLanes; ++i)
        from[i] = motions[bodies[i]].angular;
    const WideQuad second = WideRecords::read(from);
    linear = {first.a, first.b, first.c};
    angular = {second.a, second.b, second.c};
}

[[gnu::always_inline]] inline void writeMotion(const Wide3& linear, const Wide3& angular, unsigned lanes,
                                               const std::uint32_t* bodies, SolverMotion* motions)
{
    btScalar* to[kLanes];
    for (int i = 0; i < kLanes; ++i)
        to[i] = motions[bodies[i]].linear;
    WideRecords::write({linear.x, linear.y, linear.z, Wide{}}, to, lanes);
    for (int i = 0; i < kLanes; ++i)
        to[i] = motions[bodies[i]].angular;
    WideRecords::write({angular.x, angular.y, angular.z, Wide{}}, to, lanes);
}

[[gnu::always_inline]] inline PairMotion readPair(const SolverMotion* motions, const BlockBodies& bodies,
                                                  int part)
{
    PairMotion pair;
    readMotion(motions, bodies.a + part * kLanes, pair.linearA, pair.angularA);
    readMotion(motions, bodies.b + part * kLanes, pair.linearB, pair.angularB);
    return pair;
}

[[gnu::always_inline]] inline void writePair(const PairMotion& pair, const BlockBodies& bodies, int part,
                                             SolverMotion* motions)
{
    writeMotion(pair.linearA, pair.angularA, unsigned(bodies.movesA) >> (part * kLanes),
                bodies.a + part * kLanes, motions);
    writeMotion(pair.linearB, pair.angularB, unsigned(bodies.movesB) >> (part * kLanes),
                bodies.b + part * kLanes, motions);
}

/// The inverse masses of a part of a block.
struct PairMass
{
    Wide3 a, b;
};

[[gnu::always_inline]] inline PairMass massesOf(const BlockBodies& bodies, int part)
{
    return {load(bodies.inverseMassA, part), load(bodies.inverseMassB, part)};
}

/// Calls body(part, mass, pair), which changes the motions of the pairs, for each part of a block.
template <class Body>
[[gnu::always_inline]] inline void forEachPart(const BlockBodies& bodies, SolverMotion* motions,
                                               const Body& body)
{
    for (int part = 0; part < kParts; ++part)
    {
        PairMotion pair = readPair(motions, bodies, part);
        body(part, massesOf(bodies, part), pair);
        writePair(pair, bodies, part, motions);
    }
}

/// A part of a block, with the motions of its bodies.
struct BlockPart
{
    const ContactBlock& block;
    int part;
    PairMass mass;
    PairMotion pair;

    BlockPart(const ContactBlock& of, int number, const SolverMotion* motions)
        : block(of),
          part(number),
          mass(massesOf(of.bodies, number)),
          pair(readPair(motions, of.bodies, number))
    {
    }
    [[gnu::always_inline]] void write(SolverMotion* motions) const
    {
        writePair(pair, block.bodies, part, motions);
    }
};

/// Whether a part has another one beside it.
template <class Second>
constexpr bool kIsPart = !std::is_null_pointer_v<Second>;

/// Solves two parts, which do not depend on each other, side by side.
template <class Body>
[[gnu::always_inline]] inline void solveTwo(BlockPart first, BlockPart second, SolverMotion* motions,
                                            const Body& body)
{
    body(first, &second);
    first.write(motions);
    second.write(motions);
}

/// Calls body(first, second), which changes the motions of both, for all parts of blocks, none of which depends on the
/// others unless they have one lane; `second` is a pointer, or nullptr. Each row of a part waits for the one before, so that
/// two parts side by side take little longer than one.
template <class Body>
[[gnu::always_inline]] inline void forEachTwo(const ContactBlock* blocks, std::size_t count,
                                              SolverMotion* motions, const Body& body)
{
    for (std::size_t i = 0; i < count; ++i)
    {
        if constexpr (kParts > 1)
        {
            for (int part = 0; part < kParts; part += 2)
                solveTwo({blocks[i], part, motions}, {blocks[i], part + 1, motions}, motions, body);
        }
        else if (i + 1 < count && blocks[i].lanes > 1)
        {
            solveTwo({blocks[i], 0, motions}, {blocks[i + 1], 0, motions}, motions, body);
            ++i;
        }
        else
        {
            BlockPart alone(blocks[i], 0, motions);
            body(alone, nullptr);
            alone.write(motions);
        }
    }
}

[[gnu::always_inline]] inline void apply(const RowBlock& row, int part, Wide impulse, const PairMass& mass,
                                         PairMotion& pair)
{
    const Wide3 force = load(row.direction, part) * impulse;
    pair.linearA = pair.linearA + scale(force, mass.a);
    pair.linearB = pair.linearB - scale(force, mass.b);
    pair.angularA = pair.angularA + load(row.turnA, part) * impulse;
    pair.angularB = pair.angularB + load(row.turnB, part) * impulse;
}

/// The velocity along a row.
[[gnu::always_inline]] inline Wide along(const RowBlock& row, int part, const PairMotion& pair)
{
    return dot(load(row.direction, part), pair.linearA - pair.linearB) +
           dot(load(row.armA, part), pair.angularA) + dot(load(row.armB, part), pair.angularB);
}

/// The impulse with which a row reaches a target, without bounds.
[[gnu::always_inline]] inline Wide wantedImpulse(const RowBlock& row, int part, Wide target, Wide before,
                                                 const PairMotion& pair)
{
    return before +
           (target - before * load(row.softness, part) - along(row, part, pair) * load(row.inverse, part));
}

/// Applies the impulses of the first rowsOf(point) rows of each point.
template <class RowsOf>
[[gnu::always_inline]] inline void applyRows(const ContactBlock& block, const RowBlock* rows,
                                             SolverMotion* motions, const RowsOf& rowsOf)
{
    const auto applyPoints = [&](int part, const PairMass& mass, PairMotion& pair)
    {
        for (int k = 0; k < block.points; ++k)
        {
            const RowBlock* row = rows + block.rows[k].first;
            for (const RowBlock* const end = row + rowsOf(block.rows[k]); row < end; ++row)
                apply(*row, part, load(row->impulse, part), mass, pair);
        }
    };
    forEachPart(block.bodies, motions, applyPoints);
}
}  // namespace
}  // namespace CULLET_PRECISION
}  // namespace cullet
