// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/tests/support/search_options.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
struct MatrixBackend
{
    std::string name;
    std::function<std::unique_ptr<Backend>(int threads)> make;
};

/// Every algorithm, and those on a GPU where one answers.
inline std::vector<MatrixBackend> matrixBackends()
{
    const auto grid = [](const std::function<void(GridOptions&)>& change)
    {
        return [change](int threads)
        {
            GridOptions options;
            options.threads = threads;
            options.flatLimit = 0;
            change(options);
            return makeGridBackend(options);
        };
    };
    const auto psap = [](const std::function<void(SearchOptions&)>& change)
    {
        return [change](int threads)
        {
            SearchOptions options;
            options.threads = threads;
            change(options);
            return makeHostBackend(options);
        };
    };
    std::vector<MatrixBackend> backends = {
        {"grid", grid([](GridOptions&) {})},
        {"grid without instructions beyond the baseline",
         grid([](GridOptions& o) { o.baselineSimd = true; })},
        {"grid that never settles", grid([](GridOptions& o) { o.settles = false; })},
        {"flat arrays", grid([](GridOptions& o) { o.flatLimit = 1u << 20; })},
        {"flat arrays without instructions beyond the baseline", grid(
                                                                     [](GridOptions& o)
                                                                     {
                                                                         o.flatLimit = 1u << 20;
                                                                         o.baselineSimd = true;
                                                                     })},
        {"cells", [](int) { return makeCellGridBackend(); }},
        {"psap", psap([](SearchOptions&) {})},
        {"psap, shuffled", psap([](SearchOptions& o) { o.executor = PsapExecutor::Shuffled; })},
        {"psap on threads", psap([](SearchOptions& o) { o.executor = PsapExecutor::Threads; })},
        {"psap as in the thesis", psap([](SearchOptions& o) { o.isThesis = true; })},
        {"sap", [](int) { return makeSapBackend(); }},
        {"legrand", [](int) { return makeLeGrandBackend(); }},
        {"brute", [](int) { return makeBruteForceBackend(); }},
    };
    if (makeCudaPsapBackend() != nullptr)
        backends.push_back({"cuda", [](int) { return makeCudaPsapBackend(); }});
    return backends;
}
}  // namespace cullet::test
