// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/contacts/contact_finder.h"

namespace cullet::test
{
/// @param maxDistance, contactMargin negative: none
inline ContactQuery contactQuery(float margin, float maxDistance, float contactMargin = -1.0f)
{
    ContactQuery query;
    query.margin = margin;
    query.pairs.maxDistance = maxDistance;
    query.pairs.listOverlaps = true;
    query.pairs.contactMargin = contactMargin;
    return query;
}
}  // namespace cullet::test
