// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/rivals/rival.h"

#include <deque>
#include <memory>
#include <utility>
#include <vector>

namespace cullet
{
/// A collision manager of FCL, or of Coal, its fork.
///
/// Boxes are set directly: the usual interface, a transform and the box of a geometry, costs more and rounds the box.
/// `Library` has the types Object (constructible without arguments, with setBox()) and Manager, and static void
/// collide(Manager&, Pairs&), which reads the row from an object's user data.
template <class Library>
class ManagerRival : public Rival
{
public:
    using Object = typename Library::Object;
    using Base = typename Library::Base;
    using Manager = typename Library::Manager;

    explicit ManagerRival(std::unique_ptr<Manager> manager) : m_manager(std::move(manager)) {}

    void create(const Aabb* boxes, std::size_t count) override
    {
        std::vector<Base*> added;
        added.reserve(count);
        for (std::size_t i = 0; i < count; ++i)
        {
            Object& object = m_objects.emplace_back();
            object.setBox(boxes[i]);
            // A row, not an address: it is never dereferenced.
            object.setUserData(reinterpret_cast<void*>(m_objects.size() - 1));  // NOLINT
            added.push_back(&object);
        }
        m_manager->registerObjects(added);
    }

    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override
    {
        m_moved.clear();
        for (const std::uint32_t row : rows)
        {
            m_objects[row].setBox(boxes[row]);
            m_moved.push_back(&m_objects[row]);
        }
        // An update of all objects refits the tree in one pass; the other overload updates objects one by one.
        if (m_moved.size() == m_manager->size())
            m_manager->update();
        else
            m_manager->update(m_moved);
    }

    void remove(std::uint32_t row) override { m_manager->unregisterObject(&m_objects[row]); }

    void findPairs(Pairs& pairs) override
    {
        m_manager->setup();
        Library::collide(*m_manager, pairs);
    }

private:
    std::deque<Object> m_objects;  ///< before the manager, which refers to them
    std::unique_ptr<Manager> m_manager;
    std::vector<Base*> m_moved;
};

template <class Object>
std::uint32_t rowOfObject(const Object& object)
{
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(object.getUserData()));
}
}  // namespace cullet
