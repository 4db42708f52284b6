// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

// A header of the application's. cullet's of this name must not be taken for it, nor this one for cullet's.
#error "cullet includes a header of the application"
