// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/backend_session.h"

#include <algorithm>
#include <iterator>
#include <string>

namespace cullet::test
{
namespace
{
std::string words(const Pairs& pairs)
{
    std::string text = "{";
    for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 10); ++i)
        text += " " + std::to_string(pairs[i].first) + "-" + std::to_string(pairs[i].second);
    return text + (pairs.size() > 10 ? " ... " + std::to_string(pairs.size()) + " pairs }" : " }");
}

testing::AssertionResult sameList(const char* what, const Pairs& actual, const Pairs& expected)
{
    if (actual == expected)
        return testing::AssertionSuccess();
    Pairs sorted = actual;
    std::sort(sorted.begin(), sorted.end());
    Pairs missing, wrong;
    std::set_difference(expected.begin(), expected.end(), sorted.begin(), sorted.end(),
                        std::back_inserter(missing));
    std::set_difference(sorted.begin(), sorted.end(), expected.begin(), expected.end(),
                        std::back_inserter(wrong));
    return testing::AssertionFailure()
           << what << ": missing " << words(missing) << ", wrong " << words(wrong)
           << (std::is_sorted(actual.begin(), actual.end()) ? "" : ", not sorted");
}
}  // namespace

testing::AssertionResult BackendSession::step()
{
    // Remains of an earlier update in the out-parameter must have no effect.
    m_delta.added.assign(3, {7, 9});
    m_delta.removed.assign(3, {7, 9});
    const ProxyView view = table.beginUpdate(margin, useFilter);
    const Status status = m_backend->update(view, m_delta);
    const PairDelta expected = m_oracle.update(view);
    table.endUpdate();

    if (status != Status::Ok)
        return testing::AssertionFailure() << "status " << static_cast<int>(status);
    // The oracle's lists are sorted, unique and disjoint, so equal lists are too.
    if (auto same = sameList("added", m_delta.added, expected.added); !same)
        return same;
    if (auto same = sameList("removed", m_delta.removed, expected.removed); !same)
        return same;
    m_addedTotal += expected.added.size();
    m_removedTotal += expected.removed.size();
    const std::uint64_t held = m_backend->stats().pairs;
    if (held != m_oracle.pairCount())
        return testing::AssertionFailure()
               << "holds " << held << " pairs instead of " << m_oracle.pairCount();
    return testing::AssertionSuccess();
}

void BackendSession::restart(const Pairs& known)
{
    m_backend->restart(known);
    m_oracle.restart(known);
}

void BackendSession::changeBackend(std::unique_ptr<Backend> backend)
{
    m_backend = std::move(backend);
    m_backend->restart(m_oracle.pairs());
}

testing::AssertionResult BackendSession::reported(const Pairs& added, const Pairs& removed) const
{
    if (auto same = sameList("added", m_delta.added, added); !same)
        return same;
    return sameList("removed", m_delta.removed, removed);
}
}  // namespace cullet::test
