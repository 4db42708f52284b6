/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* Checks for the C programs: they print what failed and go on. */

#ifndef CULLET_TESTS_ABI_CHECK_H
#define CULLET_TESTS_ABI_CHECK_H

#include <stdint.h>
#include <stdio.h>

static int failureCount = 0;

#define CHECK(condition)                                                     \
    do                                                                       \
    {                                                                        \
        if (!(condition))                                                    \
        {                                                                    \
            printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #condition); \
            ++failureCount;                                                  \
        }                                                                    \
    } while (0)

static inline int finish(const char* name)
{
    printf("%s: %d failures\n", name, failureCount);
    return failureCount == 0 ? 0 : 1;
}

/* The same numbers on every machine. */
static inline float between(float low, float high)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (float)(state >> 40) / 16777216.0f;
}

#endif
