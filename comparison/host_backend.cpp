// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/comparison/backends.h"
#include "cullet/comparison/thesis/cell_search.h"
#include "cullet/cuda/host/host_exec.h"

namespace cullet
{
std::unique_ptr<Backend> makeHostPsapBackend(const PsapOptions& options)
{
    return std::make_unique<psap::PsapBackend<psap::HostExec>>(options, "psap", options);
}

std::unique_ptr<Backend> makeHostThesisBackend(const ThesisOptions& options)
{
    return std::make_unique<psap::PsapBackend<psap::HostExec, psap::CellSearch, ThesisOptions>>(
        options, "psap", options);
}
}  // namespace cullet
