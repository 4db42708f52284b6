// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Functions of the C interface that find contacts of hulls in GPU memory.
#include "cullet/abi/device_status.h"
#include "cullet/abi/hull_queries.h"
#include "cullet/abi/status.h"
#include "cullet/cuda/contacts/contact_finder.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/narrow/build/hull_builder.h"

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

using namespace cullet;
using namespace cullet::abi;

static_assert(sizeof(cullet_device_pose) == sizeof(BodyPose) &&
                  offsetof(cullet_device_pose, hull) == offsetof(BodyPose, hull) &&
                  offsetof(cullet_device_pose, rotation) == offsetof(BodyPose, rotation),
              "poses are passed on as they are");
static_assert(sizeof(PairAxis) == 4 * sizeof(float) && sizeof(PairDistance) == 8 * sizeof(float) &&
                  offsetof(PairDistance, distance) == 3 * sizeof(float) &&
                  sizeof(PairDepth) == 8 * sizeof(float) && offsetof(PairDepth, gap) == 7 * sizeof(float) &&
                  sizeof(PairContact) == 20 * sizeof(float) &&
                  offsetof(PairContact, points) == 4 * sizeof(float),
              "answers are handed out as they are");
static_assert(static_cast<int>(PairState::Apart) == CULLET_PAIR_APART &&
                  static_cast<int>(PairState::Overlapping) == CULLET_PAIR_OVERLAPPING &&
                  static_cast<int>(PairState::Undecided) == CULLET_PAIR_UNDECIDED &&
                  static_cast<int>(PairState::Invalid) == CULLET_PAIR_INVALID,
              "states are handed out as they are");

namespace
{
enum class SearchState
{
    None,
    Enqueued,
    Collected
};
}  // namespace

struct cullet_contact_finder
{
    std::unique_ptr<DeviceContactFinder> finder;
    SearchState state = SearchState::None;
};

namespace
{
constexpr std::uint32_t kMostBodies = 0x7fffffffu;

Hull<float> roundedHull(const cullet_hull* hull)
{
    requirePointer(hull, "a hull is NULL");
    std::vector<Eigen::Vector3f> points;
    for (std::int32_t i = 0; i < hull->hull.vertexCount(); ++i)
    {
        const Eigen::Vector3d vertex = hull->hull.vertex(i);
        require(vertex.cwiseAbs().maxCoeff() <= double(std::numeric_limits<float>::max()),
                CULLET_ERROR_NOT_FINITE, "a vertex is beyond the range of float");
        points.push_back(vertex.cast<float>());
    }
    return makeHull(points);
}

HullSet hullSetOf(const cullet_hull* const* hulls, std::uint32_t count)
{
    require(count == 0 || hulls != nullptr, CULLET_ERROR_NULL, "hulls is NULL");
    HullSet set;
    for (std::uint32_t i = 0; i < count; ++i)
        set.add(roundedHull(hulls[i]));
    return set;
}

ContactQuery queryOf(const cullet_contact_query* query)
{
    const auto known = readOptions<sizeof(cullet_contact_query)>(query);
    require(known.margin >= 0, CULLET_ERROR_ARGUMENT, "margin: not negative and no NaN expected");
    require(known.max_distance >= 0, CULLET_ERROR_ARGUMENT, "max_distance: not negative and no NaN expected");
    require(known.touching >= CULLET_TOUCHING_NONE && known.touching <= CULLET_TOUCHING_CONTACTS,
            CULLET_ERROR_ARGUMENT, "touching: one of CULLET_TOUCHING_* expected");
    require(known.contact_margin >= 0, CULLET_ERROR_ARGUMENT,
            "contact_margin: not negative and no NaN expected");
    require(known.reserved == 0, CULLET_ERROR_ARGUMENT, "query: reserved must be 0");
    ContactQuery contacts;
    contacts.margin = checkedMargin(double(known.margin));
    contacts.pairs.maxDistance = known.max_distance > 0 ? known.max_distance : -1.0f;
    contacts.pairs.listOverlaps = known.touching >= CULLET_TOUCHING_LIST;
    contacts.pairs.measureDepths = known.touching >= CULLET_TOUCHING_DEPTHS;
    contacts.pairs.contactMargin = known.touching == CULLET_TOUCHING_CONTACTS ? known.contact_margin : -1.0f;
    return contacts;
}

cullet_contacts contactsOf(const DeviceContacts& found, const std::uint64_t* deviceCount)
{
    const DevicePairAnswers& answers = found.answers;
    cullet_contacts contacts = {};
    contacts.count = answers.count;
    contacts.pairs = reinterpret_cast<const cullet_pair*>(found.pairs);
    contacts.states = reinterpret_cast<const uint8_t*>(answers.states);
    contacts.axes = reinterpret_cast<const float*>(answers.axes);
    contacts.distances = reinterpret_cast<const float*>(answers.distances);
    contacts.overlaps = answers.overlaps;
    contacts.depths = reinterpret_cast<const float*>(answers.depths);
    contacts.contacts = reinterpret_cast<const float*>(answers.contacts);
    contacts.device_count = deviceCount;
    contacts.device_overlapping = answers.overlapCount;
    return contacts;
}
}  // namespace

cullet_status cullet_contact_finder_create(const cullet_hull* const* hulls, uint32_t count,
                                           const cullet_contact_finder_options* options,
                                           cullet_contact_finder** finder)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            const auto known = readOptions<sizeof(cullet_contact_finder_options)>(options);
            requireOrdinal(known.device);
            PsapOptions psap;
            psap.device = known.device;
            std::string why;
            auto made = makeDeviceContactFinder(hullSetOf(hulls, count), psap,
                                                static_cast<CUstream_st*>(known.stream), &why);
            requireMade(made.get(), why);
            *finder = new cullet_contact_finder{std::move(made)};
            return CULLET_OK;
        });
}

void cullet_contact_finder_destroy(cullet_contact_finder* finder)
{
    delete finder;
}

cullet_status cullet_contact_finder_enqueue(cullet_contact_finder* finder,
                                            const cullet_device_pose* device_poses, uint32_t count,
                                            const cullet_contact_query* query)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            require(count == 0 || device_poses != nullptr, CULLET_ERROR_NULL, "device_poses is NULL");
            require(count <= kMostBodies, CULLET_ERROR_ARGUMENT, "2^31 bodies or more");
            const ContactQuery known = queryOf(query);
            finder->state = SearchState::None;
            requireDevice(
                finder->finder->enqueue({reinterpret_cast<const BodyPose*>(device_poses), count}, known));
            finder->state = SearchState::Enqueued;
            return CULLET_OK;
        });
}

cullet_status cullet_contact_finder_ahead(cullet_contact_finder* finder, cullet_contacts* contacts)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            requireResult<sizeof(cullet_contacts)>(contacts);
            require(finder->state == SearchState::Enqueued, CULLET_ERROR_ARGUMENT,
                    "no enqueue before, or it failed or was collected");
            const DeviceContactsAhead ahead = finder->finder->ahead();
            cullet_contacts known = contactsOf(ahead.contacts, ahead.count);
            known.overlapping = static_cast<uint32_t>(ahead.contacts.answers.room);
            writeResult(known, contacts);
            return CULLET_OK;
        });
}

cullet_status cullet_contact_finder_collect(cullet_contact_finder* finder, cullet_contacts* contacts)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            requireResult<sizeof(cullet_contacts)>(contacts);
            require(finder->state != SearchState::None, CULLET_ERROR_ARGUMENT,
                    "no enqueue before, or it failed");
            DeviceContacts found;
            ContactCounts counts;
            const Status status = finder->finder->collect(found, counts);
            finder->state = status == Status::Ok ? SearchState::Collected : SearchState::None;
            requireDevice(status);
            cullet_contacts known = contactsOf(found, finder->finder->ahead().count);
            known.overlapping = counts.pairs.overlapping;
            known.added = counts.changes.added;
            known.removed = counts.changes.removed;
            writeResult(known, contacts);
            return CULLET_OK;
        });
}

cullet_status cullet_contact_finder_forget(cullet_contact_finder* finder)
{
    return guarded(
        [&]
        {
            requirePointer(finder, "finder is NULL");
            finder->finder->forget();
            finder->state = SearchState::None;
            return CULLET_OK;
        });
}
