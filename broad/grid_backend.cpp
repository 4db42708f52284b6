// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/backend.h"
#include "broad/cell_grid_backend.h"
#include "broad/row_grid_backend.h"

namespace cullet
{
std::unique_ptr<Backend> makeGridBackend(const GridOptions& options)
{
    if (options.layout == GridLayout::Cells)
        return makeCellGridBackend(options);
    return std::make_unique<RowGridBackend>(options);
}
}  // namespace cullet
