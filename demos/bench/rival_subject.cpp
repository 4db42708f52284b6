// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/subject.h"
#include "cullet/demos/rivals/rival.h"

#include <thread>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
class RivalSubject : public Subject
{
public:
    RivalSubject(const RivalRequest& request) : m_rival(makeRival(request)), m_threads(request.threads) {}

    void create(const Aabb* boxes, std::size_t count) override { m_rival->create(boxes, count); }

    void setBoxes(const std::vector<Aabb>& boxes, const std::vector<std::uint32_t>& rows) override
    {
        m_rival->setBoxes(boxes, rows);
    }

    void remove(std::uint32_t row) override { m_rival->remove(row); }

    void findPairs() override
    {
        m_pairs.clear();
        m_rival->findPairs(m_pairs);
    }

    PairDigest digest(const std::vector<Aabb>& boxes) override
    {
        PairDigest digest;
        for (const Pair pair : m_pairs)
        {
            if (overlaps(boxes[pair.first], boxes[pair.second]))
                digest.add(pair);
        }
        return digest;
    }

    std::uint64_t heldPairs() override { return m_pairs.size(); }
    int threads() const override { return m_threads; }
    std::string path() const override { return ""; }

private:
    std::unique_ptr<Rival> m_rival;
    int m_threads;
    Pairs m_pairs;
};

int threadsOf(const SubjectRequest& request)
{
    if (!findRival(request.name)->hasThreads)
        return 1;
    return request.threads > 0 ? request.threads : static_cast<int>(std::thread::hardware_concurrency());
}
}  // namespace

std::unique_ptr<Subject> makeRivalSubject(const SubjectRequest& request)
{
    RivalRequest rival;
    rival.name = request.name;
    for (int axis = 0; axis < 3; ++axis)
    {
        rival.bounds.min[axis] = roundDownToFloat(request.bounds.min[axis]);
        rival.bounds.max[axis] = roundUpToFloat(request.bounds.max[axis]);
    }
    rival.threads = threadsOf(request);
    return std::make_unique<RivalSubject>(rival);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
