// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <nanobind/nanobind.h>

namespace cullet::python
{
void bindBoxSet(nanobind::module_& module);
void bindHulls(nanobind::module_& module);
}  // namespace cullet::python
