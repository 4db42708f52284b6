// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/abi/cullet.h"

#include <cstring>
#include <set>
#include <string>

namespace cullet::test
{
/// The errors that a call may report: any of those that its arguments have, in a call with several.
class Faults
{
public:
    /// Notes an error if it is one, and returns whether it is.
    bool add(bool isFault, cullet_status status)
    {
        if (isFault)
            m_statuses.insert(status);
        return isFault;
    }

    bool any() const { return !m_statuses.empty(); }
    bool has(cullet_status status) const { return m_statuses.count(status) != 0; }

private:
    std::set<cullet_status> m_statuses;
};

/// Compares what calls return with what they should, and follows cullet_last_error().
class CallCheck
{
public:
    /// @param remark what a call without faults returns
    /// @return whether the call had to succeed, and did
    bool expect(const char* function, cullet_status status, const Faults& faults,
                cullet_status remark = CULLET_OK)
    {
        const std::string error = cullet_last_error();
        if (!faults.any())
        {
            require(status == remark, function,
                    "returns " + nameOf(status) + " (" + error + "), not " + nameOf(remark));
            require(error == m_lastError, function, "changes the last error in a successful call");
            return status == remark;
        }
        require(faults.has(status), function, "returns " + nameOf(status) + " for wrong arguments");
        require(!error.empty() && error.find('\n') == std::string::npos && error.size() < 256, function,
                "has a bad description: " + error);
        m_lastError = error;
        return false;
    }

    void require(bool isTrue, const char* function, const std::string& fault)
    {
        if (!isTrue && m_fault.empty())
            m_fault = std::string(function) + ' ' + fault;
    }

    /// Notes an error text that other calls than those of expect() have left.
    void refresh() { m_lastError = cullet_last_error(); }

    /// Empty where all is well.
    const std::string& fault() const { return m_fault; }

    static std::string nameOf(cullet_status status)
    {
        return std::string(cullet_status_name(status)) + ' ' + std::to_string(status);
    }

private:
    std::string m_lastError = cullet_last_error();
    std::string m_fault;
};

/// A struct with a size, as a program with another version of the header has it: bytes behind it, and a sentinel.
template <class Struct>
struct Sized
{
    Struct known;
    unsigned char later[16];

    explicit Sized(std::uint32_t size, unsigned char fill = 0)
    {
        std::memset(static_cast<void*>(this), fill, sizeof(*this));
        known.size = size;
    }

    bool operator==(const Sized& other) const
    {
        return std::memcmp(static_cast<const void*>(this), static_cast<const void*>(&other), sizeof(*this)) ==
               0;
    }
};
}  // namespace cullet::test
