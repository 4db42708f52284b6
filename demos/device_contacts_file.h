// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cullet
{
/// A row of cullet_device_contacts.
struct ContactsRow
{
    const char* query;  ///< booleans or contacts
    std::uint32_t bodies;
    std::uint64_t pairs;        ///< in the last frame
    std::uint32_t overlapping;  ///< likewise
    double pointsPerContact;    ///< likewise; 0 without contacts
    double milliseconds;        ///< of a frame of the last ten, from poses to answers, by the device's clock
    std::uint64_t bytes;        ///< of device memory
};

/// Writes rows as CSV, with the machine and the commit. For a program whose source nvcc compiles.
///
/// @param csv file; empty: none
/// @throws ProgramError (kExitOutput) if the file cannot be written
void writeContactsFile(const std::vector<ContactsRow>& rows, const std::string& csv);
}  // namespace cullet
