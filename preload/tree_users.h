// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

namespace cullet::preload
{
/// Whether the library or program that has this address in it names a function or a class of btDbvt, which the trees
/// of DBVT are: it may look into the public trees of its broad phases then. Only names that the dynamic linker sees
/// count; a program that follows the nodes by hand has none.
bool namesTrees(const void* address);
}  // namespace cullet::preload
