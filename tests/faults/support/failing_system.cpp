// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// In a program that links this file, threads can fail to start, and writes of C++ streams find the disk full. The
// functions take the place of the system's for all shared libraries of the program.
#include "cullet/tests/faults/support/faults.h"

#include <cerrno>
#include <dlfcn.h>
#include <pthread.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

using cullet::test::FaultKind;
using cullet::test::isNextFault;

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                              void* argument)
{
    using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static const auto create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
    return isNextFault(FaultKind::ThreadStart) ? EAGAIN : create(thread, attributes, start, argument);
}

extern "C" ssize_t write(int file, const void* bytes, size_t count)
{
    if (!isNextFault(FaultKind::FileWrite))
        return syscall(SYS_write, file, bytes, count);
    errno = ENOSPC;
    return -1;
}

extern "C" ssize_t writev(int file, const iovec* parts, int count)
{
    if (!isNextFault(FaultKind::FileWrite))
        return syscall(SYS_writev, file, parts, count);
    errno = ENOSPC;
    return -1;
}
