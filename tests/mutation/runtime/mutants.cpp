// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// CULLET_MUTANT in the environment: the mutant that is on, or "reach". CULLET_MUTANT_REACH: the file to which "reach" appends
// a line for each test, "name <tab> milliseconds <tab> ids", and at exit one named "*" for what runs outside of tests.
#include "cullet/tests/mutation/runtime/mutants.h"

#include "cullet/tests/mutation/runtime/reach.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <unistd.h>

extern "C"
{
    unsigned char culletMutantStates[cullet_mutants::kCapacity];
}

namespace cullet_mutants
{
namespace
{
enum : unsigned char
{
    kOff,
    kOn,
    kUnreached
};

unsigned char reached[kCapacity];
const char* reachFile = nullptr;
pid_t owner = 0;

void writeRest()
{
    if (getpid() == owner)
        writeReached("*", 0);
}

// Before what has static storage, which may contain mutants.
__attribute__((constructor(101))) void start()
{
    const char* const chosen = std::getenv("CULLET_MUTANT");
    if (chosen == nullptr)
        return;
    if (std::strcmp(chosen, "reach") != 0)
    {
        const int mutant = std::atoi(chosen);
        if (mutant > 0 && mutant < kCapacity)
            culletMutantStates[mutant] = kOn;
        return;
    }
    reachFile = std::getenv("CULLET_MUTANT_REACH");
    owner = getpid();
    forgetReached();
    std::atexit(writeRest);
}
}  // namespace

void forgetReached()
{
    if (reachFile == nullptr)
        return;
    std::memset(reached, 0, sizeof(reached));
    std::memset(culletMutantStates, kUnreached, sizeof(reached));
}

void writeReached(const char* name, long milliseconds)
{
    if (reachFile == nullptr)
        return;
    std::FILE* const file = std::fopen(reachFile, "a");
    if (file == nullptr)
        return;
    std::fprintf(file, "%s\t%ld\t", name, milliseconds);
    for (int mutant = 1; mutant < kCapacity; ++mutant)
        if (__atomic_load_n(&reached[mutant], __ATOMIC_RELAXED) != 0)
            std::fprintf(file, "%d ", mutant);
    std::fputc('\n', file);
    std::fclose(file);
}
}  // namespace cullet_mutants

extern "C" bool culletAskMutant(int mutant) noexcept
{
    using namespace cullet_mutants;
    if (__atomic_load_n(&culletMutantStates[mutant], __ATOMIC_RELAXED) == kOn)
        return true;
    __atomic_store_n(&reached[mutant], 1, __ATOMIC_RELAXED);
    __atomic_store_n(&culletMutantStates[mutant], kOff, __ATOMIC_RELAXED);
    return false;
}
