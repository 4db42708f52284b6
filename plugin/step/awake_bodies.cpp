// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/awake_bodies.h"

#include "cullet/plugin/step/prefetch_step.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Nanoseconds to read the state of a body, and additionally to compare one that sleeps.
constexpr double kCostOfStateOfBody = 4, kCostOfSleeper = 20;

/// Whether two values have the same bits, those of padding too: a difference there only costs a visit.
template <class T>
[[gnu::always_inline]] inline bool matchBitByBit(const T& a, const T& b)
{
    std::uint64_t left[sizeof(T) / 8], right[sizeof(T) / 8], difference = 0;
    std::memcpy(left, &a, sizeof(T));
    std::memcpy(right, &b, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T) / 8; ++i)
        difference |= left[i] ^ right[i];
    return difference == 0;
}

/// Whether a vector is what Bullet sets to clear it: no -0, which a product would keep.
[[gnu::always_inline]] inline bool isCleared(const btVector3& vector)
{
    return matchBitByBit(vector, btVector3(0, 0, 0));
}

/// Whether damping leaves a velocity of 0 as it is: not if it is NaN. Bullet clamps it to [0, 1]. Additional damping
/// multiplies it by a factor.
bool isUsualDamping(btScalar damping)
{
    return damping >= 0 && damping <= 1;
}
}  // namespace

bool AwakeBodies::isWithoutVelocity(const btRigidBody& body)
{
    return isCleared(body.getLinearVelocity()) && isCleared(body.getAngularVelocity());
}

bool AwakeBodies::begin(const Bodies& bodies, btScalar timeStep)
{
    forget();
    m_count = bodies.size();
    m_awake.clear();
    m_awake.reserve(static_cast<std::size_t>(m_count));
    // Within these bounds a rotation by no velocity is by +0, and the power of a damping is at most 1. Bullet wakes all
    // bodies while deactivation is off.
    constexpr btScalar kLongestStep = 1000;
    m_isUsual = timeStep >= 0 && timeStep <= kLongestStep && !gDisableDeactivation &&
                gDeactivationTime != btScalar(0);
    if (!m_isUsual)
        return false;
    const auto tasks = static_cast<std::size_t>((m_count + kGrain - 1) / kGrain);
    m_found.resize(static_cast<std::size_t>(m_count));
    m_ends.resize(tasks);
    m_sleepers.resize(tasks);
    return true;
}

void AwakeBodies::examine(const Bodies& bodies, unsigned task)
{
    const int begin = static_cast<int>(task) * kGrain, last = std::min(m_count, begin + kGrain);
    const bool mostSleep = 2 * m_allSleepers > m_count;
    int end = begin, sleepers = 0;
    for (int i = begin; i < last; ++i)
    {
        if (i + kPrefetchDistance < m_count)
        {
            if (mostSleep)
                prefetchSleeper(bodies[i + kPrefetchDistance]);
            else
                prefetchState(bodies[i + kPrefetchDistance]);
        }
        const btRigidBody& body = *bodies[i];
        const bool sleeps = body.getActivationState() == ISLAND_SLEEPING;
        sleepers += sleeps;
        m_found[static_cast<std::size_t>(end)] = i;
        end += !(sleeps && isAtRest(body, static_cast<std::size_t>(i)));
    }
    m_ends[task] = end;
    m_sleepers[task] = sleepers;
}

void AwakeBodies::end(const Bodies& bodies)
{
    m_allSleepers = 0;
    for (std::size_t task = 0; task < m_ends.size(); ++task)
    {
        m_allSleepers += m_sleepers[task];
        m_awake.insert(m_awake.end(), m_found.begin() + std::ptrdiff_t(task * kGrain),
                       m_found.begin() + m_ends[task]);
    }
    m_state = resting() > 0 ? State::Listed : State::All;
    const auto count = static_cast<std::size_t>(bodies.size());
    if (m_allSleepers > 0 && m_predictions.size() < count)
        predictNone(count);
}

/// Adds predictions that are true for no body: from NaN that no computation makes.
void AwakeBodies::predictNone(std::size_t bodies)
{
    Prediction none;
    std::memset(static_cast<void*>(&none), 0xff, sizeof(none));
    m_predictions.resize(bodies, none);
}

/// Whether no loop over bodies would change a body that sleeps.
bool AwakeBodies::isAtRest(const btRigidBody& body, std::size_t index) const
{
    if (index >= m_predictions.size() || body.getHitFraction() != btScalar(1) ||
        !isCleared(body.getTotalForce()) || !isCleared(body.getTotalTorque()))
        return false;
    return body.isStaticOrKinematicObject() ||
           (isWithoutVelocity(body) && isUsualDamping(body.getLinearDamping()) &&
            isUsualDamping(body.getAngularDamping()) &&
            matchBitByBit(body.getWorldTransform(), m_predictions[index].from) &&
            matchBitByBit(body.getInterpolationWorldTransform(), m_predictions[index].to));
}

double AwakeBodies::costOfSearch(int bodies) const
{
    return kCostOfStateOfBody * bodies + kCostOfSleeper * m_allSleepers;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
