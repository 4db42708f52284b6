// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// Marks what users of the shared library may call or derive from; everything else is hidden inside it.
///
/// Used on whole classes (so that their vtable and type information are unique in the process) and on free functions
/// that are not inline. Templates and inline functions do not need it.
///
/// Under Windows the objects of the libraries write the table of what a DLL exports; programs need no mark of what they import.
#if defined(_WIN32) && defined(CULLET_BUILDS_LIBRARY)
#define CULLET_API __attribute__((dllexport))
#elif defined(_WIN32)
#define CULLET_API
#else
#define CULLET_API __attribute__((visibility("default")))
#endif
