// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
extern "C" void runTowers(const char* how);

int main(int, char** arguments)
{
    runTowers(arguments[1]);
}
