// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Compiled with -mavx2 where the compiler knows it.
#define CULLET_MESH_KERNELS kMeshKernelsAvx2
#include "cullet/mid/mesh_kernels.inl"
