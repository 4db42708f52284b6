// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

namespace cullet::preload
{
/// Whether the library or program that contains an address refers to a function or a class inside btDbvt, the type of
/// Bullet's public trees: it may then traverse the trees of its broad phases. Only names in the dynamic symbol table
/// are found; a program that follows the nodes by hand has none.
bool referencesTrees(const void* address);
}  // namespace cullet::preload
