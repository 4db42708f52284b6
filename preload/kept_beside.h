// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace cullet::preload
{
/// States of objects in the program's memory, found by their addresses since the objects must not grow. Any thread.
template <class State>
class KeptBeside
{
public:
    void add(const void* object, std::shared_ptr<State> state)
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        m_living[object] = std::move(state);
        ++m_total;
    }

    bool has(const void* object) const
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        return m_living.count(object) != 0;
    }

    /// The state of an object that has one, which stays at its address.
    State& of(const void* object) const
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        return *m_living.find(object)->second;
    }

    void remove(const void* object)
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        m_living.erase(object);
    }

    /// Calls `visit` with each object.
    template <class Visit>
    void forEach(const Visit& visit) const
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        for (const auto& [object, state] : m_living)
            visit(object, *state);
    }

    /// How many were added.
    std::uint64_t total() const
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        return m_total;
    }

private:
    mutable std::mutex m_mutex;
    std::unordered_map<const void*, std::shared_ptr<State>> m_living;
    std::uint64_t m_total = 0;
};

/// Destroys an object in the program's memory.
///
/// @param freesMemory as `delete` does
template <class T>
void destroyAs(void* memory, bool freesMemory)
{
    auto* const object = static_cast<T*>(memory);
    if (freesMemory)
        delete object;
    else
        object->~T();
}
}  // namespace cullet::preload
