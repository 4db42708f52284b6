// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/bullet_library.h"

#include "cullet/preload/message.h"

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <new>

namespace cullet::preload
{
namespace
{
/// Entries are never removed. No lock: a constructor of a library that is being opened may run this code while it holds
/// the dynamic linker's lock, for which another thread may be waiting in dlopen() below.
std::atomic<BulletLibrary*> g_libraries{nullptr};

struct Place
{
    const void* base = nullptr;
    const char* path = "";  ///< empty for the program itself
};

Place placeOf(const void* address)
{
    Dl_info info{};
    link_map* map = nullptr;
    if (dladdr1(address, &info, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) == 0 || map == nullptr)
        return {};
    return {info.dli_fbase, map->l_name};
}

/// Handle of a library that is already loaded; null for the program itself.
void* handleOf(const Place& place)
{
    return place.path[0] == '\0' ? nullptr : dlopen(place.path, RTLD_LAZY | RTLD_NOLOAD);
}

/// The function that the dynamic linker would have bound for the caller without the preloaded library.
void* resolveFor(const void* caller, const char* name)
{
    if (void* global = dlsym(RTLD_NEXT, name))
        return global;
    void* handle = handleOf(placeOf(caller));
    return handle == nullptr ? nullptr : dlsym(handle, name);
}

enum class Precision
{
    Unknown,
    Float,
    Double
};

/// Determines the precision by the size of a variable of type btScalar.
Precision precisionOf(void* handle)
{
    const void* margin = dlsym(handle, "gDbvtMargin");
    Dl_info info{};
    const ElfW(Sym)* symbol = nullptr;
    if (margin == nullptr ||
        dladdr1(margin, &info, const_cast<void**>(reinterpret_cast<const void**>(&symbol)), RTLD_DL_SYMENT) ==
            0 ||
        symbol == nullptr)
        return Precision::Unknown;
    if (symbol->st_size == sizeof(float))
        return Precision::Float;
    return symbol->st_size == sizeof(double) ? Precision::Double : Precision::Unknown;
}

/// Handle of the library of the implementation. Null, with a message, if this Bullet cannot be replaced.
void* implementationFor(void* handle, const void* constructor, const char* path)
{
    const Precision precision = precisionOf(handle);
    if (precision == Precision::Unknown)
    {
        printLine("%s: a Bullet of unknown precision; left as it is", path);
        return nullptr;
    }
    const char* file = precision == Precision::Float ? "$ORIGIN/cullet/preload-float32.so"
                                                     : "$ORIGIN/cullet/preload-float64.so";
    void* own = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (own == nullptr)
    {
        printLine("%s; Bullet is left as it is", dlerror());
        return nullptr;
    }
    // cullet was compiled with the layout and inlined functions of the headers of exactly this library.
    if (dlsym(own, CULLET_CONSTRUCT) != constructor)
    {
        printLine("%s: not the Bullet library that cullet was built for; left as it is", path);
        return nullptr;
    }
    return own;
}

BulletLibrary* find(const void* base)
{
    BulletLibrary* library = g_libraries.load(std::memory_order_acquire);
    while (library != nullptr && library->base != base)
        library = library->next;
    return library;
}

/// Adds a library to the list, unless another thread has added it first.
BulletLibrary* publish(BulletLibrary* library)
{
    BulletLibrary* first = g_libraries.load(std::memory_order_acquire);
    do
    {
        if (BulletLibrary* known = find(library->base))
        {
            std::free(library);
            return known;
        }
        library->next = first;
    } while (!g_libraries.compare_exchange_weak(first, library, std::memory_order_acq_rel));
    return library;
}

BulletLibrary* open(const void* constructor)
{
    const Place place = placeOf(constructor);
    if (BulletLibrary* known = find(place.base))
        return known;
    auto* library = new (std::calloc(1, sizeof(BulletLibrary))) BulletLibrary;
    library->base = place.base;
    void* handle = handleOf(place);
    for (std::size_t i = 0; i < kFunctionCount; ++i)
        library->functions[i] = dlsym(handle == nullptr ? RTLD_NEXT : handle, kFunctionNames[i]);
    if (handle != nullptr && !isDisabled())
        library->implementationHandle = implementationFor(handle, constructor, place.path);
    if (void* own = library->implementationHandle)
        library->implementation = reinterpret_cast<GetImplementation>(dlsym(own, kImplementationName))();
    return publish(library);
}
}  // namespace

bool isDisabled()
{
    const char* value = std::getenv("CULLET_DISABLE");
    return value != nullptr && value[0] != '\0' && std::strcmp(value, "0") != 0;
}

const void* baseOf(const void* address)
{
    return placeOf(address).base;
}

const BulletLibrary& libraryFor(const void* caller)
{
    const void* constructor = resolveFor(caller, CULLET_CONSTRUCT);
    if (constructor == nullptr)
    {
        printLine("%s: calls Bullet, and neither it nor the program is linked with it", placeOf(caller).path);
        std::abort();
    }
    return *open(constructor);
}

const BulletLibrary& knownLibraryFor(const void* caller)
{
    const BulletLibrary* first = knownLibraries();
    return first != nullptr && first->next == nullptr ? *first : libraryFor(caller);
}

void* dynamicsFunction(const BulletLibrary& bullet, DynamicsClass kind, DynamicsFunction function,
                       const void* caller)
{
    const auto row = static_cast<std::size_t>(kind), column = static_cast<std::size_t>(function);
    std::atomic<void*>& known = bullet.dynamicsFunctions[row][column];
    if (known.load(std::memory_order_acquire) == nullptr)
        known.store(resolveFor(caller, kDynamicsFunctionNames[row][column]), std::memory_order_release);
    return known.load(std::memory_order_acquire);
}

bool ownsClass(const BulletLibrary& bullet, DynamicsClass kind, const void* caller)
{
    if (bullet.implementation == nullptr)
        return false;
    const char* name = kDynamicsFunctionNames[static_cast<std::size_t>(kind)]
                                             [static_cast<std::size_t>(DynamicsFunction::Construct)];
    const void* constructor = dynamicsFunction(bullet, kind, DynamicsFunction::Construct, caller);
    if (dlsym(bullet.implementationHandle, name) == constructor)
        return true;
    bullet.implementation->keepDynamics(kind, "a library of Bullet that cullet was not built for");
    return false;
}

const BulletLibrary* knownLibraries()
{
    return g_libraries.load(std::memory_order_acquire);
}
}  // namespace cullet::preload
