// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/dynamic_type.h"

#include <array>
#include <cstddef>

namespace cullet
{
/// Remembers what the dynamic classes of objects were found to be, since comparing a class with many others compares
/// their names. It must not outlive the libraries of the classes.
///
/// @tparam Kind what a class may be; its first value, 0, stands for all other classes and those without RTTI
template <class Kind>
class ClassMemo
{
public:
    /// @param find finds the kind of the object's class
    template <class Object, class Find>
    Kind kindOf(const Object& object, const Find& find)
    {
        const std::type_info* const type = dynamicType(object);
        if (type == nullptr)
            return Kind();
        for (std::size_t i = 0; i < m_count; ++i)
        {
            if (m_entries[i].type == type)
                return m_entries[i].kind;
        }
        const Kind kind = find(object);
        if (m_count < m_entries.size())
            m_entries[m_count++] = {type, kind};
        return kind;
    }

private:
    struct Entry
    {
        const std::type_info* type;
        Kind kind;
    };
    std::array<Entry, 12> m_entries;
    std::size_t m_count = 0;
};
}  // namespace cullet
