// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/delta_search.h"
#include "cullet/cuda/contacts/box_step.h"
#include "cullet/cuda/contacts/merged_pairs.h"
#include "cullet/cuda/narrow/contact_queries.h"
#include "cullet/cuda/narrow/pair_queries.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace cullet::contacts
{
/// What is asked of a set of bodies.
struct ContactInput
{
    const BodyPose* poses = nullptr;  ///< [bodies], in the executor's memory
    std::uint32_t bodies = 0;
    float margin = 0.0f;  ///< of boxes; 0 or more
    convex::QueryExtras extras;
    float maxDistance = -1.0f;    ///< of distances
    float contactMargin = -1.0f;  ///< of contacts

    bool isSame(const ContactInput& other) const
    {
        return poses == other.poses && bodies == other.bodies && margin == other.margin &&
               extras.isMeasured == other.extras.isMeasured && extras.isListed == other.extras.isListed &&
               extras.isDeep == other.extras.isDeep && extras.hasPoints == other.extras.hasPoints &&
               maxDistance == other.maxDistance && contactMargin == other.contactMargin;
    }
};

/// Finds the boxes of bodies, the pairs of boxes that overlap, and answers these pairs, from one set of poses to the next,
/// on one executor. What is known of a pair goes with it while its boxes overlap.
///
/// An update is prepare(), which may allocate, and launch(), which only launches; finish() follows when the executor has
/// completed both.
///
/// @tparam Exec HostPairExec or CudaPairExec
template <class Exec>
class ContactSearch
{
public:
    /// @param hulls copied to the executor
    ContactSearch(Exec& exec, const HullSet& hulls, const PsapOptions& options)
        : m_changes(options), m_queries(exec, hulls), m_contacts(exec, hulls)
    {
    }

    /// Reserves memory for the next update.
    ///
    /// @return whether all memory and the input have their old addresses; otherwise recorded launches are void
    bool prepare(Exec& exec, const ContactInput& input)
    {
        const bool isSame = input.isSame(m_input);
        m_input = input;
        const std::uint64_t bytes = exec.bytes(), room = m_pairs.room();
        exec.reserve(m_boxes, std::max(input.bodies, 1u));
        const std::uint32_t rows = std::max(input.bodies, m_lastBodies);
        const bool hasOldChanges = m_changes.prepare(exec, m_boxes.data(), input.bodies);
        m_pairs.prepare(exec, m_queries, m_count, rows);
        prepareAnswers(exec);
        m_lastBodies = input.bodies;
        // What is repeated may have other rooms than what was launched before.
        const bool isUsual = !std::exchange(m_isRepeated, false);
        return isUsual && isSame && hasOldChanges && bytes == exec.bytes() && room == m_pairs.room() &&
               m_pairs.roomForChanges() == m_launchedChanges;
    }
    /// As the functions of DeltaSearch.
    bool isRepeatable(const Exec& exec) const { return m_changes.isRepeatable(exec); }
    static constexpr unsigned kPhases = psap::DeltaSearch<Exec>::kPhases;
    unsigned nextPhase() const { return m_changes.nextPhase(); }
    std::uint32_t launches() const { return m_changes.launches(); }
    void countRepeat() { m_changes.countRepeat(); }
    psap::NeighbourMode mode() const { return m_changes.mode(); }
    void advanceNextPlan(Exec& exec)
    {
        m_launchedChanges = m_pairs.roomForChanges();
        m_changes.advanceNextPlan(exec);
    }

    /// @pre prepare()
    void launch(Exec& exec)
    {
        exec.forEach(m_input.bodies,
                     BoxOfBody{m_queries.hulls(), m_input.poses, m_input.margin, m_boxes.data()});
        m_changes.launch(exec);
        merge(exec);
        answer(exec);
    }

    /// Repeats what was void, except for the answers, so that the list of pairs is right.
    ///
    /// @pre the executor has completed launch()
    /// @return whether the answers are those of the list; otherwise answerAgain() has to be called for them
    bool finish(Exec& exec)
    {
        const bool isFirst = m_count == 0;
        bool wasComplete = m_changes.finish(exec);
        const DeltaCounts& counts = m_changes.counts();
        if (!wasComplete || !m_pairs.isComplete(counts))
        {
            wasComplete = false;
            m_isRepeated = true;
            m_pairs.prepareAgain(exec, m_queries, counts);
            merge(exec);
            exec.wait();
        }
        m_pairs.learn(counts, isFirst);
        m_count = counts.pairs();
        if (wasComplete)
            m_overlapping = m_queries.counts().overlapping;
        return wasComplete;
    }
    /// Answers the pairs, with the poses as they are now, and waits.
    void answerAgain(Exec& exec)
    {
        prepareAnswers(exec);
        answer(exec);
        exec.wait();
        m_overlapping = m_queries.counts().overlapping;
    }
    /// Finds depths and contacts once more, and waits, where more pairs overlap than there was memory for.
    ///
    /// @pre the answers are those of the list
    void completeContacts(Exec& exec)
    {
        if (!m_input.extras.isDeep || m_overlapping <= m_contacts.room())
            return;
        prepareAnswers(exec);
        findContacts(exec);
        exec.wait();
    }

    /// Forgets all pairs: the next update starts without any.
    void forget()
    {
        m_changes.forget();
        forgetPairs();
    }
    /// forget() after a failure.
    void recover(const PsapOptions& options)
    {
        m_changes.recover(options);
        forgetPairs();
    }

    const MergedPairs<Exec>& pairs() const { return m_pairs; }
    const convex::PairQueries<Exec>& queries() const { return m_queries; }
    /// Depths and contacts.
    const convex::ContactQueries<Exec>& contacts() const { return m_contacts; }
    const ContactInput& input() const { return m_input; }
    const Aabb* boxes() const { return m_boxes.data(); }
    /// Of the last update that is finished.
    const DeltaCounts& changes() const { return m_changes.counts(); }
    /// Of the last update. @pre its answers are those of the list
    convex::PairCounts counts() const
    {
        convex::PairCounts counts = m_queries.counts();
        // Places of the list that have no pair are answered, too.
        counts.invalid -= static_cast<std::uint32_t>(m_pairs.room() - m_count);
        return counts;
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr std::uint64_t kFewestContacts = 1024;

    std::uint32_t roomOfPairs() const { return static_cast<std::uint32_t>(m_pairs.room()); }

    void prepareAnswers(Exec& exec)
    {
        m_queries.prepare(exec, roomOfPairs(), m_input.extras);
        if (!m_input.extras.isDeep)
            return;
        // Room for a quarter more than there were, so that it grows seldom.
        const std::uint64_t wanted = std::max<std::uint64_t>(m_overlapping, kFewestContacts);
        const std::uint64_t room = wanted > m_contacts.room() ? wanted + wanted / 4 : m_contacts.room();
        m_contacts.prepare(exec, static_cast<std::uint32_t>(std::min<std::uint64_t>(room, roomOfPairs())),
                           m_input.extras.hasPoints);
    }

    void merge(Exec& exec)
    {
        m_pairs.launch(
            exec, {m_changes.added(), m_changes.addedRoom(), m_changes.removed(), m_changes.deviceCounts()});
    }

    void answer(Exec& exec)
    {
        const convex::PairInput input = pairInput();
        m_queries.launch(exec, input);
        if (m_input.extras.isMeasured)
            m_queries.launchDistances(exec, input, m_input.maxDistance);
        if (m_input.extras.isListed)
            m_queries.launchList(exec, roomOfPairs());
        if (m_input.extras.isDeep)
            findContacts(exec);
    }

    void findContacts(Exec& exec)
    {
        const convex::PairReader reader = m_queries.readerOf(pairInput());
        const std::uint32_t* const overlaps = m_queries.overlaps();
        const std::uint32_t* const count = m_queries.overlapCount(roomOfPairs());
        m_contacts.launchDepths(exec, reader, overlaps, count);
        if (m_input.extras.hasPoints)
            m_contacts.launchContacts(exec, reader, overlaps, count, m_input.contactMargin);
    }

    convex::PairInput pairInput() const
    {
        return {m_input.poses, m_input.bodies, m_pairs.pairs(), roomOfPairs()};
    }

    void forgetPairs()
    {
        m_pairs.forget();
        m_queries.forget();
        m_contacts.forget();
        m_input = {};
        m_count = 0;
        m_lastBodies = 0;
    }

    psap::DeltaSearch<Exec> m_changes;
    MergedPairs<Exec> m_pairs;
    convex::PairQueries<Exec> m_queries;
    convex::ContactQueries<Exec> m_contacts;
    ContactInput m_input;
    std::uint32_t m_overlapping = 0;      ///< in the last update whose answers were complete
    std::uint64_t m_count = 0;            ///< pairs of the last update that is finished
    std::uint64_t m_launchedChanges = 0;  ///< room for changes of the last launch
    std::uint32_t m_lastBodies = 0;
    bool m_isRepeated = false;  ///< the last update was
    Buffer<Aabb> m_boxes;
};
}  // namespace cullet::contacts
