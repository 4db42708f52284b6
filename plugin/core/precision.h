// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// The inline namespace of all code whose layout depends on btScalar. It puts the precision into the symbol names, so
/// that a program of one precision does not link with the library of the other.
#ifndef CULLET_PRECISION
#ifdef BT_USE_DOUBLE_PRECISION
#define CULLET_PRECISION float64
#else
#define CULLET_PRECISION float32
#endif
#endif
