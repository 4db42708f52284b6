// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/box_contact.h"
#include "cullet/plugin/core/precision.h"

#include <LinearMath/btScalar.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A box as Bullet stores it.
struct BoxSource
{
    const btScalar* rows;    ///< of the rotation: three times four numbers
    const btScalar* centre;  ///< four numbers
    const btScalar* half;    ///< four numbers; half extents less the margin
    btScalar margin;
};

template <class Vector>
void readBox(const BoxSource& source, PosedBox<Vector>& box)
{
    for (int i = 0; i < 3; ++i)
        box.rows[i] = Vector::load(source.rows + 4 * i);
    box.centre = Vector::load(source.centre);
    box.half = Vector::load(source.half) + source.margin;
}

template <class Vector>
void collideSources(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group,
                    BoxContact<btScalar>& contact)
{
    PosedBox<Vector> boxA, boxB;
    readBox(a, boxA);
    readBox(b, boxB);
    collideBoxes(boxA, boxB, group, contact);
}

// collideBoxes(), compiled for an instruction set; the results are the same bits.
void collideBoxesBaseline(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group,
                          BoxContact<btScalar>& contact);
#if defined(__x86_64__)
/// Only where the processor has AVX2.
void collideBoxesAvx2(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group,
                      BoxContact<btScalar>& contact);
#endif

/// The fastest of them that the processor can run.
void collideBoxes(const BoxSource& a, const BoxSource& b, BoxAxisGroup& group, BoxContact<btScalar>& contact);
}  // namespace CULLET_PRECISION
}  // namespace cullet
