// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/device_contacts_file.h"

#include "cullet/demos/program/files/result_file.h"

namespace cullet
{
void writeContactsFile(const std::vector<ContactsRow>& rows, const std::string& csv)
{
    ResultFile file({{"command", "cullet_device_contacts"}}, "", csv);
    for (const ContactsRow& row : rows)
        file.addRow({{"benchmark", "device_contacts"},
                     {"query", row.query},
                     {"bodies", row.bodies},
                     {"pairs", row.pairs},
                     {"overlapping", row.overlapping},
                     {"points_per_contact", row.pointsPerContact},
                     {"mean_ms", row.milliseconds},
                     {"bytes", row.bytes}});
    file.save();
}
}  // namespace cullet
