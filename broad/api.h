// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// Marks what users of the shared library may call or derive from; everything else is hidden inside it.
///
/// Used on whole classes (so that their vtable and type information are unique in the process) and on free functions
/// that are not inline. Templates and inline functions do not need it.
#define CULLET_API __attribute__((visibility("default")))
