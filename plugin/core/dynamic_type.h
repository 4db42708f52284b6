// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <typeinfo>

namespace cullet
{
/// The class of an object that the application may have made; null if that class was compiled without RTTI.
template <class T>
const std::type_info* dynamicType(const T& object) noexcept
{
    const std::type_info* type = &typeid(object);
    // The virtual table of such a class has null there, which the compiler does not expect.
    asm("" : "+r"(type));
    return type;
}

/// Whether an object is of a class, and not of one derived from it. False where its class was compiled without RTTI.
///
/// Classes without a function in Bullet's library, such as btCapsuleShapeX, have a type_info in every library with hidden
/// visibility; hence a comparison by name, which type_info does, where the address is another.
template <class T, class Base>
bool isExactly(const Base& object) noexcept
{
    const std::type_info* const type = dynamicType(object);
    return type == &typeid(T) || (type != nullptr && *type == typeid(T));
}

/// dynamic_cast of a pointer, which may be null. Null too where the object's class was compiled without RTTI.
///
/// @tparam To without the pointer; const if From is
template <class To, class From>
To* dynamicCast(From* object) noexcept
{
    return object != nullptr && dynamicType(*object) != nullptr ? dynamic_cast<To*>(object) : nullptr;
}
}  // namespace cullet
