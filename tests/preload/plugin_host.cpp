// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program without Bullet that opens plug-ins with Bullet, possibly of different precisions, closes them, and opens
// them again.

#include <cstdio>
#include <dlfcn.h>

int main(int count, char** files)
{
    for (int i = 1; i < count; ++i)
    {
        void* plugin = dlopen(files[i], RTLD_NOW | RTLD_LOCAL);
        if (plugin == nullptr)
        {
            std::puts(dlerror());
            return 1;
        }
        reinterpret_cast<void (*)(const char*)>(dlsym(plugin, "runTowers"))("stack");
        dlclose(plugin);
    }
    for (int i = 1; i < count; ++i)
        reinterpret_cast<void (*)(const char*)>(dlsym(dlopen(files[i], RTLD_NOW | RTLD_LOCAL), "runTowers"))(
            "derived");
}
