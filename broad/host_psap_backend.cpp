// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/host_exec.h"
#include "cullet/broad/psap_backend.h"

namespace cullet
{
std::unique_ptr<Backend> makeHostPsapBackend(const PsapOptions& options)
{
    return std::make_unique<psap::PsapBackend<psap::HostExec>>(options, "psap", options);
}
}  // namespace cullet
