/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Whether there is a GPU, and whether there has to be one: CULLET_REQUIRE_GPU=1 in the environment. */

#ifndef CULLET_TESTS_ABI_CHECK_DEVICE_H
#define CULLET_TESTS_ABI_CHECK_DEVICE_H

#include <cuda_runtime_api.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline int hasDevice(void)
{
    int count = 0;
    const cudaError_t error = cudaGetDeviceCount(&count);
    if (error != cudaSuccess)
        printf("no device: %s\n", cudaGetErrorString(error));
    return error == cudaSuccess && count > 0;
}

static inline int isDeviceRequired(void)
{
    const char* required = getenv("CULLET_REQUIRE_GPU");
    return required != NULL && strcmp(required, "0") != 0;
}

#endif
