// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Compiled with -mavx2 where the compiler knows it.
#define CULLET_QUERY_KERNELS kQueryKernelsAvx2
#include "cullet/broad/queries/query_kernels.inl"
