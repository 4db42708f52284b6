# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

# Sets CULLET_HAS_CUDA and enables the CUDA language, as the option CULLET_CUDA asks.

include_guard(GLOBAL)

set(CULLET_HAS_CUDA FALSE)
if(NOT CULLET_CUDA MATCHES "^(AUTO|ON|OFF|TRUE|FALSE|1|0)$")
    message(FATAL_ERROR "CULLET_CUDA is '${CULLET_CUDA}'; AUTO, ON or OFF expected")
endif()
if(CULLET_CUDA)
    # 11.8 and 13 both accept these; 90 also carries PTX, which newer devices compile on first use.
    if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
        set(CMAKE_CUDA_ARCHITECTURES 75 80 90)
    endif()
    # NVIDIA's own packages leave nvcc outside PATH, and so does cmake/install_cuda.sh.
    if(NOT DEFINED CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
        find_program(CULLET_NVCC nvcc PATHS /usr/local/cuda/bin
            "${PROJECT_SOURCE_DIR}/build/cuda-toolkit/nvidia/cu13/bin")
        mark_as_advanced(CULLET_NVCC)
        if(CULLET_NVCC)
            set(CMAKE_CUDA_COMPILER "${CULLET_NVCC}")
        endif()
    endif()
    include(CheckLanguage)
    check_language(CUDA)
    if(CMAKE_CUDA_COMPILER)
        enable_language(CUDA)
        find_package(CUDAToolkit REQUIRED)
        set(CULLET_HAS_CUDA TRUE)
    elseif(NOT CULLET_CUDA STREQUAL "AUTO")
        message(FATAL_ERROR "CULLET_CUDA is ON and no CUDA compiler was found; set CUDACXX or CMAKE_CUDA_COMPILER")
    endif()
endif()
if(CULLET_HAS_CUDA)
    message(STATUS "CUDA backend: on, nvcc ${CMAKE_CUDA_COMPILER_VERSION}, architectures ${CMAKE_CUDA_ARCHITECTURES}")
else()
    message(STATUS "CUDA backend: off")
endif()
