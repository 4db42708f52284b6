// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <mutex>

namespace cullet
{
/// Makes fork() wait for a mutex that all worlds of the process share, and unlocks it in both processes: a forked process
/// has no other thread than the one that forked, so a mutex that another thread had locked would stay locked for ever.
///
/// @param mutex lives as long as the process, and is never locked around another one of these, nor around calls of the
///              application, which may fork. At most eight; where there are more, or no memory, nothing is done.
void holdWhileForking(std::mutex& mutex) noexcept;
}  // namespace cullet
