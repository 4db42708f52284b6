// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace cullet
{
/// std::vector of trivially copyable elements, for layouts that a program shares with the library.
///
/// A standard container has another layout where the program is compiled for debug containers (_GLIBCXX_DEBUG) and the
/// library is not. This one has the same in every mode: three pointers. Member functions do what those of std::vector
/// do, its iterators are pointers.
///
/// @tparam Allocator without state
template <class T, class Allocator = std::allocator<T>>
class Array
{
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    static_assert(std::is_empty_v<Allocator>);

    template <class Iterator>
    using IfIterator = typename std::iterator_traits<Iterator>::iterator_category;

public:
    using value_type = T;
    using size_type = std::size_t;
    using difference_type = std::ptrdiff_t;
    using reference = T&;
    using const_reference = const T&;
    using iterator = T*;
    using const_iterator = const T*;

    Array() noexcept = default;
    explicit Array(std::size_t size) { resize(size); }
    Array(std::size_t size, const T& value) { resize(size, value); }
    Array(std::initializer_list<T> values) { append(values.begin(), values.size()); }
    template <class Iterator, class = IfIterator<Iterator>>
    Array(Iterator begin, Iterator end)
    {
        insert(m_end, begin, end);
    }
    Array(const Array& other) { append(other.m_begin, other.size()); }
    Array(Array&& other) noexcept { swap(other); }
    ~Array()
    {
        if (m_begin != nullptr)
            Allocator().deallocate(m_begin, capacity());
    }
    Array& operator=(const Array& other)
    {
        if (this != &other)
            assign(other.m_begin, other.m_end);
        return *this;
    }
    Array& operator=(Array&& other) noexcept
    {
        Array(std::move(other)).swap(*this);
        return *this;
    }

    T* begin() noexcept { return m_begin; }
    T* end() noexcept { return m_end; }
    const T* begin() const noexcept { return m_begin; }
    const T* end() const noexcept { return m_end; }
    const T* cbegin() const noexcept { return m_begin; }
    const T* cend() const noexcept { return m_end; }
    T* data() noexcept { return m_begin; }
    const T* data() const noexcept { return m_begin; }
    T& operator[](std::size_t i) noexcept { return m_begin[i]; }
    const T& operator[](std::size_t i) const noexcept { return m_begin[i]; }
    T& front() noexcept { return *m_begin; }
    const T& front() const noexcept { return *m_begin; }
    T& back() noexcept { return m_end[-1]; }
    const T& back() const noexcept { return m_end[-1]; }

    std::size_t size() const noexcept { return static_cast<std::size_t>(m_end - m_begin); }
    std::size_t capacity() const noexcept { return static_cast<std::size_t>(m_limit - m_begin); }
    bool empty() const noexcept { return m_begin == m_end; }

    void reserve(std::size_t room)
    {
        if (room > capacity())
            reallocate(room);
    }
    void resize(std::size_t size) { resize(size, T()); }
    void resize(std::size_t size, const T& value)
    {
        const T copy = value;
        makeRoomFor(size);
        T* const end = m_begin + size;
        if (m_end < end)
            std::uninitialized_fill(m_end, end, copy);
        m_end = end;
    }
    /// New elements have any value: each is to be written before it is read.
    void resizeForOverwrite(std::size_t size)
    {
        makeRoomFor(size);
        m_end = m_begin + size;
    }
    void shrink_to_fit() { Array(*this).swap(*this); }
    void clear() noexcept { m_end = m_begin; }
    void assign(std::size_t size, const T& value)
    {
        const T copy = value;
        clear();
        resize(size, copy);
    }
    /// The range may not be one of this array.
    template <class Iterator, class = IfIterator<Iterator>>
    void assign(Iterator begin, Iterator end)
    {
        clear();
        insert(m_end, begin, end);
    }

    void push_back(const T& value)
    {
        const T copy = value;
        if (m_end == m_limit)
            grow();
        ::new (static_cast<void*>(m_end)) T(copy);
        ++m_end;
    }
    void pop_back() noexcept { --m_end; }

    /// The range may not be one of this array.
    template <class Iterator, class = IfIterator<Iterator>>
    T* insert(const T* place, Iterator begin, Iterator end)
    {
        const auto count = static_cast<std::size_t>(std::distance(begin, end));
        const auto at = static_cast<std::size_t>(place - m_begin);
        makeRoomFor(size() + count);
        T* const gap = m_begin + at;
        if (gap != m_end)
            std::memmove(static_cast<void*>(gap + count), gap, (size() - at) * sizeof(T));
        std::uninitialized_copy(begin, end, gap);
        m_end += count;
        return gap;
    }
    T* insert(const T* place, const T& value)
    {
        const T copy = value;
        return insert(place, &copy, &copy + 1);
    }
    T* erase(const T* begin, const T* end) noexcept
    {
        T* const to = m_begin + (begin - m_begin);
        m_end = std::copy(end, static_cast<const T*>(m_end), to);
        return to;
    }
    T* erase(const T* place) noexcept { return erase(place, place + 1); }

    void swap(Array& other) noexcept
    {
        std::swap(m_begin, other.m_begin);
        std::swap(m_end, other.m_end);
        std::swap(m_limit, other.m_limit);
    }

private:
    void append(const T* values, std::size_t count)
    {
        if (count != 0)
            insert(m_end, values, values + count);
    }

    void makeRoomFor(std::size_t size)
    {
        if (size > capacity())
            reallocate(std::max(size, 2 * this->size()));
    }

    void grow() { reallocate(std::max<std::size_t>(1, 2 * size())); }

    void reallocate(std::size_t room)
    {
        if (room > std::numeric_limits<std::ptrdiff_t>::max() / sizeof(T))
            throw std::bad_alloc();
        T* const memory = Allocator().allocate(room);
        const std::size_t size = this->size();
        if (m_begin != nullptr)
        {
            std::memcpy(static_cast<void*>(memory), m_begin, size * sizeof(T));
            Allocator().deallocate(m_begin, capacity());
        }
        m_begin = memory;
        m_end = memory + size;
        m_limit = memory + room;
    }

    T* m_begin = nullptr;
    T* m_end = nullptr;
    T* m_limit = nullptr;
};

template <class T, class Allocator>
bool operator==(const Array<T, Allocator>& a, const Array<T, Allocator>& b)
{
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin());
}

template <class T, class Allocator>
bool operator!=(const Array<T, Allocator>& a, const Array<T, Allocator>& b)
{
    return !(a == b);
}

template <class T, class Allocator>
void swap(Array<T, Allocator>& a, Array<T, Allocator>& b) noexcept
{
    a.swap(b);
}
}  // namespace cullet
