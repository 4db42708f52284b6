// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/worlds/world_run.h"

#include <array>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kMostSteps = 200;
}  // namespace

WorldRun::WorldRun(const std::uint8_t* data, std::size_t size)
    : m_choices(data, size), m_worlds(chosenWorlds(m_choices))
{
    m_noise = Noise(m_worlds.noise);
    createBodies(m_worlds.bodies, 2, btVector3(0, 0, 0));
}

std::size_t WorldRun::anySlot()
{
    std::array<std::size_t, WorldTwin::kSlots> taken{};
    std::uint32_t count = 0;
    for (std::size_t slot = 0; slot < WorldTwin::kSlots; ++slot)
        if (!first().isFree(slot))
            taken[count++] = slot;
    const std::uint8_t bits = m_choices.byte();
    return count == 0 ? 0 : taken[bits % count];
}

void WorldRun::step(btScalar time, int substeps, btScalar fixed)
{
    if (m_steps++ < kMostSteps)
        forEach([&](WorldTwin& twin) { twin.world().stepSimulation(time, substeps, fixed); });
}

btVector3 WorldRun::noisePlace(float reach)
{
    const float x = m_noise.upTo(reach), y = m_noise.upTo(reach), z = m_noise.upTo(reach);
    return btVector3(x, y, z);
}

void WorldRun::createBodies(std::uint32_t count, float reach, const btVector3& centre)
{
    for (std::uint32_t i = 0; i < count; ++i)
    {
        BodyRecipe recipe;
        const auto bits = static_cast<std::uint32_t>(m_noise.upTo(1) * 32768 + 32768);
        recipe.shape = {static_cast<ShapeKind>(bits % static_cast<std::uint32_t>(ShapeKind::kCount)),
                        static_cast<std::uint8_t>(bits >> 8), m_worlds.settings.family};
        recipe.shape.kind = kindWithin(m_worlds.settings.family, recipe.shape.kind);
        if (bits % 7 == 6)
            recipe.kind = BodyRecipe::Kind::PairGhost;
        recipe.pose =
            btTransform(btQuaternion(btVector3(0, 1, 0), m_noise.upTo(3)), noisePlace(reach) + centre);
        const std::size_t slot = first().freeSlot();
        forEach([&](WorldTwin& twin) { twin.create(slot, recipe); });
    }
}

void WorldRun::check()
{
    for (const auto& twin : m_worlds.twins)
    {
        const std::string fault = twin->check();
        if (!fault.empty())
            fail(*twin, fault);
    }
    std::vector<std::pair<WorldTwin*, WorldTwin::State>> groups;
    for (const auto& twin : m_worlds.twins)
    {
        WorldTwin::State state = twin->takeState();
        std::size_t group = 0;
        while (group < groups.size() && groups[group].first->recipe().group != twin->recipe().group)
            ++group;
        if (group == groups.size())
            groups.push_back({twin.get(), std::move(state)});
        else
            compare(*twin, state, *groups[group].first, groups[group].second);
    }
}

void WorldRun::compare(const WorldTwin& twin, const WorldTwin::State& state, const WorldTwin& other,
                       const WorldTwin::State& expected)
{
    if (state.words == expected.words)
        return;
    std::size_t place = 0;
    while (place < state.words.size() && place < expected.words.size() &&
           state.words[place] == expected.words[place])
        ++place;
    const auto& names = place < state.names.size() ? state.names : expected.names;
    fail(twin, names[place] + " differs from that of the twin '" + other.recipe().name + "'");
}

void WorldRun::fail(const WorldTwin& twin, const std::string& fault)
{
    if (m_fault.empty())
        m_fault =
            "operation " + std::to_string(m_operations) + ", twin '" + twin.recipe().name + "': " + fault;
}
}  // namespace cullet::test
