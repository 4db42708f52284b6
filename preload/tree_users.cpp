// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/tree_users.h"

#include <cstddef>
#include <cstring>
#include <dlfcn.h>
#include <elf.h>
#include <link.h>

namespace cullet::preload
{
namespace
{
/// The symbol table of a library: names that it exports and imports.
struct Symbols
{
    const ElfW(Sym) * first = nullptr;
    const char* names = nullptr;
    std::size_t namesSize = 0;
};

Symbols symbolsOf(const link_map& map)
{
    Symbols result;
    for (const ElfW(Dyn)* entry = map.l_ld; entry->d_tag != DT_NULL; ++entry)
    {
        if (entry->d_tag == DT_SYMTAB)
            result.first = reinterpret_cast<const ElfW(Sym)*>(entry->d_un.d_ptr);
        else if (entry->d_tag == DT_STRTAB)
            result.names = reinterpret_cast<const char*>(entry->d_un.d_ptr);
        else if (entry->d_tag == DT_STRSZ)
            result.namesSize = entry->d_un.d_val;
    }
    return result;
}

/// Whether a mangled name is a member of btDbvt or of a class inside it; btDbvtBroadphase has another length prefix.
bool isTreeSymbol(const char* name)
{
    return std::strstr(name, "N6btDbvt") != nullptr || std::strstr(name, "NK6btDbvt") != nullptr;
}
}  // namespace

bool referencesTrees(const void* address)
{
    Dl_info info{};
    link_map* map = nullptr;
    if (dladdr1(address, &info, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) == 0 || map == nullptr)
        return false;
    const Symbols symbols = symbolsOf(*map);
    if (symbols.first == nullptr || symbols.names == nullptr)
        return false;
    // The number of symbols is not stored anywhere. Linkers place the names after them; bytes between the two are read
    // as symbols without harm.
    const auto* end = reinterpret_cast<const ElfW(Sym)*>(symbols.names);
    for (const ElfW(Sym)* symbol = symbols.first; symbol + 1 <= end; ++symbol)
    {
        if (symbol->st_name < symbols.namesSize && isTreeSymbol(symbols.names + symbol->st_name))
            return true;
    }
    return false;
}
}  // namespace cullet::preload
