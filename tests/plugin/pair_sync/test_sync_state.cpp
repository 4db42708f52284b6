// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/sync_state.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace cullet::test
{
namespace
{
using State = SyncState::State;

/// In the state, by the events that lead there.
SyncState stateOf(State wanted)
{
    SyncState state;
    if (wanted == State::Restart || wanted == State::RestartAndReevaluate)
        state.restart();
    if (wanted == State::Reevaluate || wanted == State::RestartAndReevaluate)
        state.reevaluate();
    if (wanted == State::CacheChanged)
        state.changeCache();
    EXPECT_EQ(state.state(), wanted);
    return state;
}

constexpr State kIdle[] = {State::InSync, State::CacheChanged, State::Restart, State::Reevaluate,
                           State::RestartAndReevaluate};

State after(State state, void (SyncState::*event)() noexcept)
{
    SyncState changed = stateOf(state);
    (changed.*event)();
    return changed.state();
}
}  // namespace

TEST(SyncState, JoinsReasonsBetweenUpdates)
{
    const State both = State::RestartAndReevaluate;
    const State restarted[] = {State::Restart, State::CacheChanged, State::Restart, both, both};
    const State reevaluated[] = {State::Reevaluate, both, both, State::Reevaluate, both};
    const State changed[] = {State::CacheChanged, State::CacheChanged, State::Restart, both, both};
    for (int i = 0; i < 5; ++i)
    {
        EXPECT_EQ(after(kIdle[i], &SyncState::restart), restarted[i]) << i;
        EXPECT_EQ(after(kIdle[i], &SyncState::reevaluate), reevaluated[i]) << i;
        EXPECT_EQ(after(kIdle[i], &SyncState::changeCache), changed[i]) << i;
    }
}

TEST(SyncState, NamesWhatIsToDo)
{
    const bool restarts[] = {false, true, true, false, true};
    const bool reevaluates[] = {false, false, false, true, true};
    for (int i = 0; i < 5; ++i)
    {
        const SyncState state = stateOf(kIdle[i]);
        EXPECT_EQ(state.needsRestart(), restarts[i]) << i;
        EXPECT_EQ(state.mustReevaluateAll(), reevaluates[i]) << i;
        EXPECT_EQ(state.isCacheChanged(), kIdle[i] == State::CacheChanged) << i;
        EXPECT_FALSE(state.isUpdating()) << i;
    }
}

TEST(SyncState, EndsUpdateInSyncUnlessBackendTakesOver)
{
    for (const State idle : kIdle)
    {
        SyncState state = stateOf(idle);
        {
            SyncState::Update update(state);
            EXPECT_TRUE(state.isUpdating());
            EXPECT_TRUE(state.needsRestart());  // a query in a callback is not answered by the backend
            update.consumeChanges();
            update.end(false);
        }
        EXPECT_EQ(state.state(), State::InSync);
        {
            SyncState::Update update(state);
            update.consumeChanges();
            update.end(true);
        }
        EXPECT_EQ(state.state(), State::CacheChanged);
    }
}

TEST(SyncState, RestartsAfterInterruptedUpdate)
{
    for (const auto event : {&SyncState::restart, &SyncState::reevaluate, &SyncState::changeCache})
    {
        SyncState state;
        {
            SyncState::Update update(state);
            update.consumeChanges();
            (state.*event)();
            EXPECT_EQ(state.state(), State::Interrupted);
            (state.*event)();
            EXPECT_EQ(state.state(), State::Interrupted);
            update.end(true);
        }
        EXPECT_EQ(state.state(), State::RestartAndReevaluate);
    }
}

TEST(SyncState, RestartsAfterExceptionInUpdate)
{
    const State early[] = {State::Restart, State::CacheChanged, State::Restart, State::RestartAndReevaluate,
                           State::RestartAndReevaluate};
    for (int i = 0; i < 5; ++i)
    {
        for (const bool consumes : {false, true})
        {
            SyncState state = stateOf(kIdle[i]);
            try
            {
                SyncState::Update update(state);
                if (consumes)
                    update.consumeChanges();
                throw std::runtime_error("in an update");
            }
            catch (const std::runtime_error&)
            {
            }
            EXPECT_EQ(state.state(), consumes ? State::RestartAndReevaluate : early[i]) << i;
        }
    }
}
}  // namespace cullet::test
