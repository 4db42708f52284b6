// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>
#include <vector>

namespace cullet
{
/// Draws the figures whose CSV files are in a folder, into the same folder: SVG and PNG, by demos/plots/plot.py of the
/// source tree that this program was built from.
///
/// @param names file names without ending
/// @return whether the plots were drawn; if not, the reason and a remedy are on stderr
bool drawFigures(const std::string& folder, const std::vector<std::string>& names);
}  // namespace cullet
