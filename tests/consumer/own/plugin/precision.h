// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

// A header of the application, which must not be confused with cullet's header of the same name.
#error "cullet includes a header of the application"
