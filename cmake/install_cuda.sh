#!/usr/bin/env bash
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# Installs what the CUDA backend needs to be built, by the NVIDIA driver that is there: CUDA 13 into build/ for driver 580
# and later, else Debian's CUDA 11.8. Never installs or changes a driver.

# shellcheck source=cmake/bootstrap.sh
source "$(dirname "${BASH_SOURCE[0]}")/bootstrap.sh"

# The first number of the kernel module's version, or nothing where it does not say (WSL).
driver_version()
{
    grep -oE -m 1 '[0-9]{3,}\.[0-9.]+' /proc/driver/nvidia/version 2>/dev/null | head -n 1 | cut -d . -f 1 || true
}

# NVIDIA's packages on PyPI: a fifth of the whole toolkit, nothing outside build/, no driver among their dependencies.
install_cuda_13()
{
    need_packages python3-pip ca-certificates
    say "installing CUDA 13.0 from PyPI into build/cuda-toolkit (270 MB)"
    # All by name: their dependencies would be taken in the newest version.
    run_quietly python3 -m pip install --upgrade --target "$CULLET_ROOT/build/cuda-toolkit" --no-deps \
        'nvidia-cuda-nvcc==13.0.*' 'nvidia-cuda-crt==13.0.*' 'nvidia-nvvm==13.0.*' \
        'nvidia-cuda-runtime==13.0.*' 'nvidia-cuda-cccl==13.0.*' || die "could not install CUDA 13"
    # Where nvcc looks for libraries, and what CMake takes for a whole toolkit.
    ln -sfn lib "$CULLET_TOOLKIT/lib64"
    ln -sf libcudart.so.13 "$CULLET_TOOLKIT/lib/libcudart.so"
}

install_debians_cuda()
{
    # The package depends on Debian's driver library, which would take the place of another driver's.
    if ! dpkg-query -W -f '${db:Status-Status}' libcuda1 2>/dev/null | grep -qx installed; then
        die "driver $1 is too old for CUDA 13 and not Debian's: update it to 580, or install the CUDA toolkit (11.8" \
            "or later) that belongs to it from https://developer.nvidia.com/cuda-toolkit-archive"
    fi
    if ! apt-cache show nvidia-cuda-toolkit >/dev/null 2>&1; then
        die "add 'contrib non-free' to the components in /etc/apt/sources.list, run apt-get update, and try again"
    fi
    need_packages nvidia-cuda-toolkit
}

if nvcc_path >/dev/null; then
    say "there is $(nvcc_path)"
    exit
fi
driver=$(driver_version)
if [ "${driver:-580}" -ge 580 ]; then
    install_cuda_13
else
    install_debians_cuda "$driver"
fi
say "installed $(nvcc_path)"
