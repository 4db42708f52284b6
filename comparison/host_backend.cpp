// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/psap_backend.h"
#include "cullet/comparison/backends.h"
#include "cullet/comparison/thesis/thesis_backend.h"
#include "cullet/cuda/host/host_exec.h"

namespace cullet
{
std::unique_ptr<Backend> makeHostPsapBackend(const PsapOptions& options)
{
    return std::make_unique<psap::PsapBackend<psap::HostExec>>(options, "psap", options);
}

std::unique_ptr<Backend> makeHostThesisBackend(const ThesisOptions& options)
{
    return std::make_unique<psap::ThesisBackend<psap::HostExec>>(options, "psap");
}
}  // namespace cullet
