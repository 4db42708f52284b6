// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
/// A backend with options, under a name made of letters and digits.
struct BackendCase
{
    std::string name;
    std::function<std::unique_ptr<Backend>()> make;
};

inline void PrintTo(const BackendCase& value, std::ostream* stream)
{
    *stream << value.name;
}

/// The backends that the conformance suite runs on; each program that holds the suite defines its own list.
const std::vector<BackendCase>& backendCases();

/// Base of the suite's fixtures.
class BackendTest : public testing::TestWithParam<BackendCase>
{
};

inline std::string backendCaseName(const testing::TestParamInfo<BackendCase>& info)
{
    return info.param.name;
}
}  // namespace cullet::test

/// Runs a fixture's tests on every backend of the program.
#define CULLET_ON_EVERY_BACKEND(Fixture)                                                         \
    INSTANTIATE_TEST_SUITE_P(Backends, Fixture, testing::ValuesIn(cullet::test::backendCases()), \
                             cullet::test::backendCaseName)
