/* SPDX-FileCopyrightText: the cullet authors */
/* SPDX-License-Identifier: Zlib */

/* A program in C finds the header and the library. */

#include <cullet/cullet.h>
#include <stdio.h>

int main(void)
{
    printf("cullet %s, interface %u\n", cullet_version(), (unsigned)cullet_abi_version());
    return cullet_abi_version() >= CULLET_ABI_VERSION ? 0 : 1;
}
