// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/comparison/backends.h"

#include <memory>

namespace cullet::test
{
/// Options of a search on an executor: of the product's, or of the thesis's.
struct SearchOptions : ThesisOptions
{
    bool isThesis = false;
};

inline SearchOptions thesisSearch()
{
    SearchOptions options;
    options.isThesis = true;
    return options;
}

inline std::unique_ptr<Backend> makeHostBackend(const SearchOptions& options)
{
    return options.isThesis ? makeHostThesisBackend(options) : makeHostPsapBackend(options);
}

inline std::unique_ptr<Backend> makeCudaBackend(const SearchOptions& options)
{
    return options.isThesis ? makeCudaThesisBackend(options) : makeCudaPsapBackend(options);
}
}  // namespace cullet::test
