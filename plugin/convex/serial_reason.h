// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/contact_stats.h"
#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/core/precision.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What Bullet's global callbacks, the dispatcher's flags and the step's options say against jobs; None if nothing does.
///
/// @param callbacksAreThreadSafe see DispatcherOptions
SerialReason findSerialReason(const btCollisionDispatcher& dispatcher, const IsaGjkRegistration& isaGjk,
                              const btDispatcherInfo& info, bool callbacksAreThreadSafe);
}  // namespace CULLET_PRECISION
}  // namespace cullet
