// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// operator new and delete of a program in all their forms. The source that includes this has, in an unnamed namespace:
//   void* take(std::size_t size) noexcept;  null without memory
//   void* takeAligned(std::size_t size, std::size_t alignment) noexcept;
//   void give(void* memory) noexcept;

// Not inlined, since the compiler would report a mismatch of free() and operator new.
[[gnu::noinline]] void* operator new(std::size_t size)
{
    if (void* memory = take(size))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept
{
    return take(size);
}

[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment)
{
    if (void* memory = takeAligned(size, static_cast<std::size_t>(alignment)))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment,
                                     const std::nothrow_t&) noexcept
{
    return takeAligned(size, static_cast<std::size_t>(alignment));
}

[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    give(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    give(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept
{
    give(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
    give(memory);
}
