// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <typeinfo>

namespace cullet
{
/// The dynamic class of an object, maybe of the application; null if that class was compiled without RTTI.
template <class T>
const std::type_info* dynamicType(const T& object) noexcept
{
    const std::type_info* type = &typeid(object);
    // The virtual table of a class without RTTI contains null, which the compiler assumes to be impossible.
    asm("" : "+r"(type));
    return type;
}

/// Whether an object is exactly of a class, not of a derived one. False if its class was compiled without RTTI.
///
/// A class without a function in Bullet's library, such as btCapsuleShapeX, has one type_info per library with hidden
/// visibility. Therefore type_info's comparison by name follows if the addresses differ.
template <class T, class Base>
bool isExactly(const Base& object) noexcept
{
    const std::type_info* const type = dynamicType(object);
    return type == &typeid(T) || (type != nullptr && *type == typeid(T));
}

/// As isExactly() for any of several classes. Their addresses are compared first, since a comparison of two names costs
/// more than all of these.
template <class... Ts, class Base>
bool isExactlyAnyOf(const Base& object) noexcept
{
    const std::type_info* const type = dynamicType(object);
    return ((type == &typeid(Ts)) || ...) || (type != nullptr && ((*type == typeid(Ts)) || ...));
}

/// dynamic_cast of a pointer, which may be null. Null also if the object's class was compiled without RTTI.
///
/// @tparam To the target type without the pointer; const if From is
template <class To, class From>
To* dynamicCast(From* object) noexcept
{
    return object != nullptr && dynamicType(*object) != nullptr ? dynamic_cast<To*>(object) : nullptr;
}
}  // namespace cullet
