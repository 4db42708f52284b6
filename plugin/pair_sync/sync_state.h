// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <utility>

namespace cullet
{
/// What a PairSync has to do besides applying changes of boxes, or what it is doing.
///
/// ```
///              changeCache()
///     InSync ───────────────> CacheChanged ──────────────────────────┐
///       │  │       restart()                                         │ reevaluate()
///       │  └────────────────> Restart ───────────────────────────────┤
///       │         reevaluate()              restart(), changeCache() │
///       └───────────────────> Reevaluate ────────────────────────────┴──> RestartAndReevaluate
///
///     each of these ── begin() ──> Updating ── end() ──> InSync, or CacheChanged if a backend takes over
///                                     │ restart(), reevaluate(), changeCache()
///                                     └──> Interrupted ── end() ──> RestartAndReevaluate
/// ```
///
/// begin() and end() are those of an Update. An exception leaves RestartAndReevaluate, once the update has consumed the
/// changes of boxes, before that the former state after restart(). The events that are not drawn change nothing.
class SyncState
{
public:
    enum class State : std::uint8_t
    {
        InSync,                ///< the backend holds the pairs of the cache and the deferred ones
        CacheChanged,          ///< a restart from the pairs of the cache shows which ones others removed
        Restart,               ///< the backend restarts from the pairs of the cache, which lacks none
        Reevaluate,            ///< all deferred pairs are re-evaluated
        RestartAndReevaluate,  ///< both: the changes of some boxes have been lost, or the filter is another one
        Updating,
        Interrupted  ///< as Updating, but a callback or a lack of memory made this update incomplete
    };

    State state() const noexcept { return m_state; }
    bool isUpdating() const noexcept { return m_state >= State::Updating; }
    bool isInterrupted() const noexcept { return m_state == State::Interrupted; }
    bool needsRestart() const noexcept { return m_state != State::InSync && m_state != State::Reevaluate; }
    bool mustReevaluateAll() const noexcept
    {
        return m_state == State::Reevaluate || m_state == State::RestartAndReevaluate;
    }
    /// Whether the cache's changes are the only reason for the restart: other reasons hide which pairs were removed.
    bool isCacheChanged() const noexcept { return m_state == State::CacheChanged; }

    /// The backend is to begin anew.
    void restart() noexcept
    {
        if (m_state == State::InSync)
            m_state = State::Restart;
        else if (m_state == State::Reevaluate)
            m_state = State::RestartAndReevaluate;
        else if (m_state == State::Updating)
            m_state = State::Interrupted;
    }
    /// The deferred pairs may be others, or have other answers of the filter.
    void reevaluate() noexcept
    {
        if (m_state == State::InSync)
            m_state = State::Reevaluate;
        else if (isUpdating())
            m_state = State::Interrupted;
        else if (m_state != State::Reevaluate)
            m_state = State::RestartAndReevaluate;
    }
    /// Others have added pairs to the cache or removed some.
    void changeCache() noexcept
    {
        if (m_state == State::InSync)
            m_state = State::CacheChanged;
        else
            restart();
    }

    /// An update, as a scope.
    class Update
    {
    public:
        /// begin(): an exception before consumeChanges() leaves the changes to the next update, and a new backend.
        explicit Update(SyncState& state) noexcept : m_state(state)
        {
            m_state.restart();
            m_next = std::exchange(m_state.m_state, State::Updating);
        }
        ~Update() { m_state.m_state = m_next; }
        Update(const Update&) = delete;
        Update& operator=(const Update&) = delete;

        /// From now on the changed boxes are those of this update.
        void consumeChanges() noexcept { m_next = State::RestartAndReevaluate; }
        /// The cache has all pairs, unless the update was interrupted.
        ///
        /// @param backendTakesOver whether the next update is the first one of a backend
        void end(bool backendTakesOver) noexcept
        {
            if (!m_state.isInterrupted())
                m_next = backendTakesOver ? State::CacheChanged : State::InSync;
        }

    private:
        SyncState& m_state;
        State m_next;
    };

private:
    State m_state = State::InSync;
};
}  // namespace cullet
