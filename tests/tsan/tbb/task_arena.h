// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

/// A stand-in, made of std::thread, for the few oneTBB functions that cullet uses; first on the include path of a
/// ThreadSanitizer build and of nothing else.
///
/// No distribution builds libtbb with ThreadSanitizer, which therefore sees neither the hand-over of a task to a thread
/// nor the end of a loop, and reports every loop body as a race with the loop before it. Suppressing those reports would
/// suppress the real ones too, since a body always runs below oneTBB's frames. Here the only synchronisation is the start
/// and the end of the threads, which ThreadSanitizer knows; anything else that two tasks share is reported.
///
/// Use of another oneTBB function is a compile error in the cpu-tsan preset: add it here.

#pragma once

#include <thread>
#include <utility>

namespace tbb
{
namespace stand_in
{

/// Where the calling thread is: how many threads its arena has, which of them it is, and whether a loop runs there.
struct Place
{
    int concurrency = 0;
    int index = -1;
    bool isInLoop = false;
};

inline Place& place()
{
    thread_local Place instance;
    return instance;
}

/// Sets the place of the calling thread and puts the old one back at the end of the scope.
class PlaceScope
{
public:
    explicit PlaceScope(const Place& now) : m_before(place()) { place() = now; }
    ~PlaceScope() { place() = m_before; }
    PlaceScope(const PlaceScope&) = delete;
    PlaceScope& operator=(const PlaceScope&) = delete;

private:
    Place m_before;
};

}  // namespace stand_in

namespace this_task_arena
{

constexpr int not_initialized = -2;

inline int max_concurrency()
{
    const int here = stand_in::place().concurrency;
    // At least two: with one thread there is nothing to look at.
    const int processors = static_cast<int>(std::thread::hardware_concurrency());
    return here > 0 ? here : (processors > 2 ? processors : 2);
}

inline int current_thread_index()
{
    const int here = stand_in::place().index;
    return here >= 0 ? here : not_initialized;
}

}  // namespace this_task_arena

class task_arena
{
public:
    static constexpr int automatic = -1;

    explicit task_arena(int concurrency = automatic, unsigned = 1)
        : m_concurrency(concurrency > 0 ? concurrency : this_task_arena::max_concurrency())
    {
    }

    int max_concurrency() const { return m_concurrency; }

    template <class Function>
    auto execute(Function&& function)
    {
        const stand_in::PlaceScope scope({m_concurrency, 0, false});
        return std::forward<Function>(function)();
    }

private:
    int m_concurrency;
};

}  // namespace tbb
