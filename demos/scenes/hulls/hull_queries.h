// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"

// Queries of hulls as tests and demos use them, instantiated in hull_queries.cpp: in each of their sources they would take most
// of the time to compile. What is inlined everywhere stays in each.

/// @param LINKAGE extern, or nothing for the instances themselves
/// @param S       scalar of the query
/// @param A, B    the shapes
#define CULLET_GJK_SEARCH(LINKAGE, S, A, B)                                                     \
    LINKAGE template void gjkSearch(const A&, const B&, S, GjkCache<S>&, NoObserver&, GjkStart, \
                                    GjkResult<S>&);

/// @param H scalar of the hulls
#define CULLET_HULL_QUERIES(LINKAGE, S, H)                                                                  \
    CULLET_GJK_SEARCH(LINKAGE, S, PosedHull<H>, PosedHull<H>)                                               \
    LINKAGE template GjkResult<S> gjkDistance(const PosedHull<H>&, const PosedHull<H>&, S, GjkCache<S>&,    \
                                              NoObserver&, GjkStart);                                       \
    LINKAGE template GjkResult<S> gjkDistance(const PosedHull<H>&, const PosedHull<H>&, S, GjkCache<S>&);   \
    LINKAGE template bool gjkFromAxis(const PosedHull<H>&, const PosedHull<H>&, GjkCache<S>&, NoObserver&,  \
                                      GjkResult<S>&);                                                       \
    LINKAGE template bool gjkFromCorner(const PosedHull<H>&, const PosedHull<H>&, S, GjkCache<S>&,          \
                                        NoObserver&, GjkResult<S>&);                                        \
    LINKAGE template bool gjkOverlapFromCorner(const PosedHull<H>&, const PosedHull<H>&, GjkCache<S>&,      \
                                               NoObserver&, GjkResult<S>&);                                 \
    LINKAGE template void rememberCorner(const PosedHull<H>&, const PosedHull<H>&, GjkCache<S>&);           \
    LINKAGE template GjkResult<S> isaGjk(const PosedHull<H>&, const PosedHull<H>&, S, GjkCache<S>&);        \
    LINKAGE template GjkResult<S> isaGjkSearch(const PosedHull<H>&, const PosedHull<H>&, double,            \
                                               GjkCache<S>&, NoObserver&, const AxisTest<H>&,               \
                                               IsaGjkVariant);                                              \
    LINKAGE template bool isaGjkFromTetrahedron(const PosedHull<H>&, const PosedHull<H>&, H, GjkCache<S>&,  \
                                                NoObserver&, GjkResult<S>&);                                \
    LINKAGE template bool isaGjkFromCorner(const PosedHull<H>&, const PosedHull<H>&, H, const AxisTest<H>&, \
                                           GjkCache<S>&, NoObserver&, GjkResult<S>&);                       \
    LINKAGE template bool isaGjkFromFailedAxis(const PosedHull<H>&, const PosedHull<H>&, H, GjkCache<S>&,   \
                                               NoObserver&, GjkResult<S>&, AxisTest<H>&, bool);             \
    LINKAGE template bool isaGjkOnFirstAxis(const PosedHull<H>&, const PosedHull<H>&, H, GjkCache<S>&,      \
                                            NoObserver&, GjkResult<S>&, AxisTest<H>&);

#define CULLET_HULL_DEPTHS(LINKAGE, S)                                                                    \
    LINKAGE template PenetrationResult<S> penetration(const PosedHull<S>&, const PosedHull<S>&,           \
                                                      GjkCache<S>&, EpaCache*);                           \
    LINKAGE template PenetrationResult<S> rememberedPenetration(const PosedHull<S>&, const PosedHull<S>&, \
                                                                GjkCache<S>&, EpaCache&);                 \
    LINKAGE template bool exactPenetration(const PosedHull<S>&, const PosedHull<S>&, Eigen::Vector3d&,    \
                                           double&);                                                      \
    CULLET_GJK_SEARCH(LINKAGE, double, MovedShape<PosedHull<S>>, PosedHull<S>)                            \
    CULLET_GJK_SEARCH(LINKAGE, double, MovedShape<PreciseHull<S>>, PreciseHull<S>)                        \
    LINKAGE template bool findClearFace(const Hull<S>&, std::array<std::int32_t, 3>, ClearFace&);         \
    LINKAGE template SupportHit<S> hitBlocks(const Hull<S>&, const Eigen::Matrix<S, 3, 1>&);

#define CULLET_ALL_HULL_QUERIES(LINKAGE)         \
    CULLET_HULL_QUERIES(LINKAGE, float, float)   \
    CULLET_HULL_QUERIES(LINKAGE, double, double) \
    CULLET_HULL_QUERIES(LINKAGE, double, float)  \
    CULLET_HULL_DEPTHS(LINKAGE, float)           \
    CULLET_HULL_DEPTHS(LINKAGE, double)

// A program for processors with AVX2 has instances of its own.
#ifndef __AVX2__
namespace cullet
{
CULLET_ALL_HULL_QUERIES(extern)
}  // namespace cullet
#endif
