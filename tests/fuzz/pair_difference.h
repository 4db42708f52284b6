// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>

namespace cullet::test
{
inline std::string text(const Pairs& pairs)
{
    std::string words = "{";
    for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 6); ++i)
        words += " " + std::to_string(pairs[i].first) + "-" + std::to_string(pairs[i].second);
    return words + (pairs.size() > 6 ? " ... of " + std::to_string(pairs.size()) : "") + " }";
}

/// How a list differs from the expected one, which is in order; empty if it does not.
inline std::string differenceOf(const std::string& what, const Pairs& found, const Pairs& expected)
{
    if (found == expected)
        return {};
    Pairs sorted = found, missing, wrong;
    std::sort(sorted.begin(), sorted.end());
    std::set_difference(expected.begin(), expected.end(), sorted.begin(), sorted.end(),
                        std::back_inserter(missing));
    std::set_difference(sorted.begin(), sorted.end(), expected.begin(), expected.end(),
                        std::back_inserter(wrong));
    const bool isInOrder = std::is_sorted(found.begin(), found.end());
    return what + (isInOrder ? "" : " out of order,") + " misses " + text(missing) + ", has besides " +
           text(wrong);
}
}  // namespace cullet::test
