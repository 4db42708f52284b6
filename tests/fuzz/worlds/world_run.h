// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/fuzz/box_choice.h"
#include "cullet/tests/fuzz/choices.h"
#include "cullet/tests/fuzz/worlds/world_choice.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace cullet::test
{
/// The worlds of one input, what is done to all of them, and what is compared.
class WorldRun
{
public:
    WorldRun(const std::uint8_t* data, std::size_t size);

protected:
    template <class Action>
    void forEach(const Action& action)
    {
        for (const auto& twin : m_worlds.twins)
            twin->guarded([&] { action(*twin); });
    }

    /// Of a byte: a slot that is taken in the first world, or the first one.
    std::size_t anySlot();

    template <class Action>
    void forSlot(const Action& action)
    {
        forSlot(anySlot(), action);
    }

    template <class Action>
    void forSlot(std::size_t slot, const Action& action)
    {
        forEach(
            [&](WorldTwin& twin)
            {
                if (!twin.isFree(slot))
                    action(twin, slot);
            });
    }

    WorldTwin& first() { return *m_worlds.twins.front(); }
    void step(btScalar time, int substeps, btScalar fixed);
    btVector3 noisePlace(float reach);
    void createBodies(std::uint32_t count, float reach, const btVector3& centre);
    /// Each twin alone, and twins of a group with each other.
    void check();

    Choices m_choices;
    WorldChoice m_worlds;
    Noise m_noise{1};
    std::string m_fault;
    std::uint32_t m_operations = 0;

private:
    void compare(const WorldTwin& twin, const WorldTwin::State& state, const WorldTwin& other,
                 const WorldTwin::State& expected);
    void fail(const WorldTwin& twin, const std::string& fault);

    int m_steps = 0;
};
}  // namespace cullet::test
