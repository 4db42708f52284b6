// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/convex_file.h"

#include "cullet/cuda/narrow/contact_queries.h"
#include "cullet/cuda/narrow/host_pair_exec.h"
#include "cullet/cuda/narrow/pair_queries.h"

#include <Eigen/Core>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace cullet
{
namespace
{
PsapOptions onAllCores()
{
    PsapOptions options;
    options.executor = PsapExecutor::Threads;
    return options;
}

/// cullet's answers to the pairs of a frame.
struct Answers
{
    std::vector<float> depths;  ///< a depth for each pair, 0 of those that are apart
    ConvexFileSums sums;
};

/// The answers of pairs that overlap, found on an executor.
void collect(const convex::PairQueries<convex::HostPairExec>& queries,
             const convex::ContactQueries<convex::HostPairExec>& contacts, Answers& answers)
{
    std::uint64_t points = 0;
    for (std::uint32_t k = 0; k < answers.sums.overlapping; ++k)
    {
        const PairDepth& found = contacts.depths()[k];
        if (!isProved(found))
            throw std::runtime_error("a depth is not proved");
        answers.depths[queries.overlaps()[k]] = found.depth;
        points += contacts.contacts()[k].count;
    }
    answers.sums.pointsPerContact = static_cast<double>(points) / std::max(answers.sums.overlapping, 1u);
}

Answers answersTo(const ConvexMotion& motion, int frame)
{
    const std::vector<BodyPose>& poses = motion.frame(frame);
    const std::vector<RowPair>& pairs = motion.pairs();
    const convex::PairInput input = {poses.data(), static_cast<std::uint32_t>(poses.size()), pairs.data(),
                                     static_cast<std::uint32_t>(pairs.size())};
    convex::HostPairExec exec(onAllCores());
    convex::PairQueries<convex::HostPairExec> queries(exec, motion.hulls());
    queries.prepare(exec, input.count, {false, true, true, true});
    queries.launch(exec, input);
    queries.launchList(exec, input.count);
    const std::uint32_t* const count = queries.overlapCount(input.count);
    motion.requireOverlapping(*count);
    convex::ContactQueries<convex::HostPairExec> contacts(exec, motion.hulls());
    contacts.prepare(exec, *count, true);
    contacts.launchDepths(exec, queries.readerOf(input), queries.overlaps(), count);
    contacts.launchContacts(exec, queries.readerOf(input), queries.overlaps(), count, kContactMargin);
    Answers answers;
    answers.depths.assign(pairs.size(), 0.0f);
    answers.sums.overlapping = *count;
    collect(queries, contacts, answers);
    return answers;
}

template <class T>
void write(std::ofstream& file, const std::vector<T>& values)
{
    file.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof(T)));
}
}  // namespace

ConvexFileSums writeConvexFile(const ConvexMotion& motion, int frame, const std::string& path)
{
    std::vector<std::uint32_t> starts = {0};
    std::vector<float> points;
    for (const Hull<double>& hull : motion.exactHulls())
    {
        for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
        {
            const Eigen::Vector3f point = hull.vertex(i).cast<float>();
            points.insert(points.end(), {point[0], point[1], point[2]});
        }
        starts.push_back(static_cast<std::uint32_t>(points.size() / 3));
    }
    ConvexFileHead head;
    head.hulls = static_cast<std::uint32_t>(starts.size()) - 1;
    head.points = starts.back();
    head.pairs = static_cast<std::uint32_t>(motion.pairs().size());
    const Answers answers = answersTo(motion, frame);
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(&head), sizeof(head));
    write(file, starts);
    write(file, points);
    write(file, motion.frame(frame));
    write(file, answers.depths);
    file.close();
    if (!file)
        throw std::runtime_error("cannot write " + path);
    return answers.sums;
}
}  // namespace cullet
