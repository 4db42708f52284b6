// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_device_contacts [BODIES] [--csv FILE]: contacts of a simulation on the GPU.
//
// Hulls tumble through a box on the device. In every frame one kernel moves them, DeviceContactFinder finds the pairs that
// are near each other and the contacts of those that overlap, and another kernel pushes these apart. The CPU fetches
// results and waits only in every tenth frame, to print; a finder that remembers nothing then answers the same poses, as
// a check. A second finder is asked only which pairs overlap, to show what contacts cost.

#include "cullet/cuda/contacts/contact_finder.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/demos/device_balls.cuh"
#include "cullet/demos/device_contacts_file.h"
#include "cullet/demos/device_hulls.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace cullet;

constexpr int kFrames = 100, kPrinted = 10;
constexpr std::uint32_t kHulls = 16;
constexpr int kPoints = 42;
constexpr unsigned kBlocks = 1024;  // the number of overlaps is unknown to the CPU: grid-stride loop
constexpr float kContactMargin = 0.02f;
// A sum of integers does not depend on its order, so that every run is the same.
constexpr float kPushUnit = 1e-6f;

/// How a body moves on.
struct Motion
{
    float velocity[3];
    int push[3];  ///< in kPushUnit
};

__global__ void __launch_bounds__(kThreads)
    start(std::uint32_t count, float side, Motion* motions, BodyPose* poses)
{
    const std::uint32_t body = blockIdx.x * kThreads + threadIdx.x;
    if (body >= count)
        return;
    Motion motion = {};
    BodyPose pose = {};
    pose.hull = body % kHulls;
    for (std::uint32_t axis = 0; axis < 3; ++axis)
    {
        pose.position[axis] = side * fractionOf(body, axis);
        motion.velocity[axis] = 0.1f * (fractionOf(body, axis + 3) - 0.5f);
    }
    motions[body] = motion;
    poses[body] = pose;
}

/// Moves hulls back and forth between the walls and by what pushes them, and turns each about an axis of its own.
__global__ void __launch_bounds__(kThreads)
    tumble(std::uint32_t count, float side, float time, Motion* motions, BodyPose* poses)
{
    const std::uint32_t body = blockIdx.x * kThreads + threadIdx.x;
    if (body >= count)
        return;
    Motion motion = motions[body];
    BodyPose pose = poses[body];
    float length2 = 1e-6f;
    for (std::uint32_t axis = 0; axis < 3; ++axis)
    {
        const float place =
            pose.position[axis] + motion.velocity[axis] + kPushUnit * static_cast<float>(motion.push[axis]);
        motion.push[axis] = 0;
        if (place < 0 || place > side)
            motion.velocity[axis] = copysignf(motion.velocity[axis], place < 0 ? 1.0f : -1.0f);
        pose.position[axis] = fminf(fmaxf(place, 0.0f), side);
        pose.rotation[axis] = fractionOf(body, axis + 6) - 0.5f;
        length2 += pose.rotation[axis] * pose.rotation[axis];
    }
    const float angle = 0.2f * time + 3.0f * fractionOf(body, 9);
    for (std::uint32_t axis = 0; axis < 3; ++axis)
        pose.rotation[axis] *= sinf(angle) * rsqrtf(length2);
    pose.rotation[3] = cosf(angle);
    motions[body] = motion;
    poses[body] = pose;
}

/// Pushes both bodies of each contact by a quarter of its depth, and counts the contacts of each body.
///
/// @param missed [out] whether a list was too short, so that only collect() has all answers
__global__ void __launch_bounds__(kThreads)
    pushApart(DeviceContactsAhead found, Motion* motions, unsigned* touching, unsigned* missed)
{
    const DevicePairAnswers& answers = found.contacts.answers;
    if (*found.count == ~std::uint64_t{0})
    {
        *missed = 1;
        return;
    }
    std::uint64_t count = *answers.overlapCount;
    if (count > answers.room)
    {
        *missed = 1;
        count = answers.room;
    }
    for (std::uint64_t k = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x; k < count;
         k += kBlocks * kThreads)
    {
        const RowPair pair = found.contacts.pairs[answers.overlaps[k]];
        const PairContact& contact = answers.contacts[k];
        const float way = 0.25f * contact.points[0].depth / kPushUnit;
        for (int axis = 0; axis < 3; ++axis)
        {
            // The normal goes from b to a.
            const int push = __float2int_rn(way * contact.normal[axis]);
            atomicAdd(&motions[pair.a].push[axis], push);
            atomicAdd(&motions[pair.b].push[axis], -push);
        }
        atomicAdd(&touching[pair.a], 1u);
        atomicAdd(&touching[pair.b], 1u);
    }
}

template <class T>
std::vector<T> fetch(const T* from, std::uint64_t count, cudaStream_t stream)
{
    std::vector<T> there(count);
    checkCuda(cudaMemcpyAsync(there.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost, stream));
    checkCuda(cudaStreamSynchronize(stream));
    return there;
}

/// Whether two arrays of the device have the same bytes.
template <class T>
bool areEqual(const T* a, const T* b, std::uint64_t count, cudaStream_t stream)
{
    return std::memcmp(fetch(a, count, stream).data(), fetch(b, count, stream).data(), count * sizeof(T)) ==
           0;
}

std::unique_ptr<DeviceContactFinder> makeFinder(const HullSet& hulls, cudaStream_t stream)
{
    std::string why;
    auto finder = makeDeviceContactFinder(hulls, {}, stream, &why);
    if (!finder)
        throw std::runtime_error(why);
    return finder;
}

ContactQuery withContacts()
{
    ContactQuery query;
    query.pairs.contactMargin = kContactMargin;
    return query;
}

/// A finder that is asked the same in every frame, and its times.
class TimedFinder
{
public:
    TimedFinder(const HullSet& hulls, const ContactQuery& query, cudaStream_t stream)
        : m_query(query), m_finder(makeFinder(hulls, stream))
    {
        for (int frame = 0; frame < kPrinted; ++frame)
            m_timers.emplace_back(stream);
    }

    void enqueue(const DeviceBodies& bodies, int frame)
    {
        StreamTimer& timer = m_timers[static_cast<std::size_t>(frame % kPrinted)];
        timer.begin();
        requireOk(m_finder->enqueue(bodies, m_query));
        timer.end();
    }
    DeviceContactsAhead ahead() const { return m_finder->ahead(); }
    DeviceContacts collect(ContactCounts& counts)
    {
        DeviceContacts found;
        requireOk(m_finder->collect(found, counts));
        return found;
    }
    /// Of the last ten frames, in the mean.
    double milliseconds() const
    {
        double sum = 0;
        for (const StreamTimer& timer : m_timers)
            sum += timer.milliseconds();
        return sum / kPrinted;
    }
    std::uint64_t bytes() const { return m_finder->bytes(); }

private:
    ContactQuery m_query;
    std::unique_ptr<DeviceContactFinder> m_finder;
    std::deque<StreamTimer> m_timers;
};

/// Contacts of tumbling hulls.
class Tumbling
{
public:
    Tumbling(std::uint32_t bodies, cudaStream_t stream)
        : m_bodies(bodies),
          m_stream(stream),
          m_side(std::cbrt(24.0f * static_cast<float>(bodies))),
          m_hulls(hullsOnSphere(kHulls, kPoints)),
          m_poses(allocate<BodyPose>(bodies)),
          m_motions(allocate<Motion>(bodies)),
          m_touching(allocate<unsigned>(bodies)),
          m_missed(allocate<unsigned>(1)),
          m_booleans(m_hulls, {}, stream),
          m_contacts(m_hulls, withContacts(), stream),
          m_check(makeFinder(m_hulls, stream))
    {
        checkCuda(cudaMemsetAsync(m_missed, 0, sizeof(unsigned), stream));
        start<<<blocksFor(bodies), kThreads, 0, stream>>>(bodies, m_side, m_motions, m_poses);
        checkCuda(cudaGetLastError());
    }
    Tumbling(const Tumbling&) = delete;
    Tumbling& operator=(const Tumbling&) = delete;
    ~Tumbling()
    {
        cudaFree(m_poses);
        cudaFree(m_motions);
        cudaFree(m_touching);
        cudaFree(m_missed);
    }

    void step(int frame)
    {
        tumble<<<blocksFor(m_bodies), kThreads, 0, m_stream>>>(
            m_bodies, m_side, 0.1f * static_cast<float>(frame), m_motions, m_poses);
        checkCuda(cudaGetLastError());
        m_booleans.enqueue({m_poses, m_bodies}, frame);
        m_contacts.enqueue({m_poses, m_bodies}, frame);
        checkCuda(cudaMemsetAsync(m_touching, 0, m_bodies * sizeof(unsigned), m_stream));
        pushApart<<<kBlocks, kThreads, 0, m_stream>>>(m_contacts.ahead(), m_motions, m_touching, m_missed);
        checkCuda(cudaGetLastError());
    }

    void print(int frame)
    {
        const DeviceContacts found = m_contacts.collect(m_counts);
        const bool wasShort = fetch(m_missed, 1, m_stream)[0] != 0;
        checkCuda(cudaMemsetAsync(m_missed, 0, sizeof(unsigned), m_stream));
        check(found);
        const std::uint32_t overlapping = m_counts.pairs.overlapping;
        std::uint64_t touching = 0, points = 0;
        for (const unsigned count : fetch(m_touching, m_bodies, m_stream))
            touching += count;
        if (!wasShort && touching != 2 * std::uint64_t{overlapping})
            throw std::runtime_error("a hull touches another number of hulls");
        for (const PairContact& contact : fetch(found.answers.contacts, overlapping, m_stream))
            points += contact.count;
        m_points = overlapping == 0 ? 0.0 : static_cast<double>(points) / overlapping;
        std::printf(
            "frame %d: %llu pairs, %llu entered, %llu left, %u overlap, %.2f points a contact, %u "
            "searched%s\n",
            frame, static_cast<unsigned long long>(m_counts.changes.pairs()),
            static_cast<unsigned long long>(m_counts.changes.added),
            static_cast<unsigned long long>(m_counts.changes.removed), overlapping, m_points,
            m_counts.pairs.failed + m_counts.pairs.remembered, wasShort ? "; lists have grown" : "");
    }

    /// Of the last ten frames. @pre print() of the last one
    ContactsRow row(bool hasContacts) const
    {
        const TimedFinder& finder = hasContacts ? m_contacts : m_booleans;
        return {hasContacts ? "contacts" : "booleans",
                m_bodies,
                m_counts.changes.pairs(),
                m_counts.pairs.overlapping,
                hasContacts ? m_points : 0.0,
                finder.milliseconds(),
                finder.bytes()};
    }

private:
    /// Compares with a finder that remembers nothing, and states with those of the one without contacts.
    void check(const DeviceContacts& found)
    {
        DeviceContacts anew;
        ContactCounts counts;
        m_check->forget();
        requireOk(m_check->enqueue({m_poses, m_bodies}, withContacts()));
        requireOk(m_check->collect(anew, counts));
        const DevicePairAnswers &a = found.answers, &b = anew.answers;
        const std::uint64_t overlapping = counts.pairs.overlapping;
        if (a.count != b.count || !areEqual(a.states, b.states, a.count, m_stream) ||
            m_counts.pairs.overlapping != overlapping ||
            !areEqual(a.overlaps, b.overlaps, overlapping, m_stream) ||
            !areEqual(a.depths, b.depths, overlapping, m_stream) ||
            !areEqual(a.contacts, b.contacts, overlapping, m_stream))
            throw std::runtime_error("the answers depend on what is remembered");
        const DevicePairAnswers plain = m_booleans.collect(counts).answers;
        if (a.count != plain.count || !areEqual(a.states, plain.states, a.count, m_stream))
            throw std::runtime_error("the booleans depend on whether contacts are asked for");
    }

    std::uint32_t m_bodies;
    cudaStream_t m_stream;
    float m_side;
    HullSet m_hulls;
    BodyPose* m_poses;
    Motion* m_motions;
    unsigned* m_touching;
    unsigned* m_missed;
    TimedFinder m_booleans, m_contacts;
    std::unique_ptr<DeviceContactFinder> m_check;
    ContactCounts m_counts;
    double m_points = 0;  ///< of a contact
};

void run(std::uint32_t bodies, const std::string& csv)
{
    const Stream stream;
    Tumbling tumbling(bodies, stream.get());
    for (int frame = 0; frame < kFrames; ++frame)
    {
        tumbling.step(frame);
        if (frame % kPrinted == kPrinted - 1)
            tumbling.print(frame);
    }
    const std::vector<ContactsRow> rows = {tumbling.row(false), tumbling.row(true)};
    for (const ContactsRow& row : rows)
        std::printf("%s: %.3f ms a frame of the last ten, from poses to answers, by the device's clock\n",
                    row.query, row.milliseconds);
    writeContactsFile(rows, csv);
}
}  // namespace

int main(int argc, char** argv)
{
    std::string csv;
    std::vector<char*> others;
    for (int i = 0; i < argc; ++i)
    {
        if (std::strcmp(argv[i], "--csv") == 0 && i + 1 < argc)
            csv = argv[++i];
        else
            others.push_back(argv[i]);
    }
    return mainWithBalls("cullet_device_contacts", static_cast<int>(others.size()), others.data(),
                         [&](std::uint32_t bodies) { run(bodies, csv); });
}
