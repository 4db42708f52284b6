// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// The inline namespace of everything whose layout depends on btScalar. It carries the precision into the names that the
/// linker sees, so that a program of one precision does not link with the library of the other.
#ifndef CULLET_PRECISION
#ifdef BT_USE_DOUBLE_PRECISION
#define CULLET_PRECISION float64
#else
#define CULLET_PRECISION float32
#endif
#endif
