// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Links cullet as a user does: compiles if the headers are found under their installed name, links if the libraries
// bring what they need.

#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <cullet/broad/backend.h>
#include <memory>
#include <string>

int main()
{
    std::string why = "a CUDA device answers";
    const std::unique_ptr<cullet::Backend> cuda = cullet::makeCudaPsapBackend({}, &why);
    const btVector3 gravity(0, -10, 0);
    std::printf("scalar of %zu bytes, gravity %g; CUDA: %s\n", sizeof(btScalar), double(gravity.y()),
                why.c_str());
    return (cuda != nullptr) == (why == "a CUDA device answers") ? 0 : 1;
}
