// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/fuzz_driver.h"

int main(int count, char** arguments)
{
    return cullet::test::runFuzzDriver(count, arguments);
}
