// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// A function that a program binds to this library first.
#define CULLET_EXPORT extern "C" __attribute__((visibility("default")))
/// An address in the library that has called the current function.
#define CULLET_CALLER __builtin_return_address(0)
