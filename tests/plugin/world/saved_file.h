// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/world/saved_world.h"

#include <BulletWorldImporter/btMultiBodyWorldImporter.h>
#include <gtest/gtest.h>

#include <vector>

namespace cullet::test
{
/// What Bullet's serialiser writes, contacts included.
inline std::vector<char> saveFile(SavedWorld& saved)
{
    btDefaultSerializer serializer;
    serializer.setSerializationFlags(serializer.getSerializationFlags() | BT_SERIALIZE_CONTACT_MANIFOLDS);
    saved.world.serialize(&serializer);
    const auto* data = reinterpret_cast<const char*>(serializer.getBufferPointer());
    return std::vector<char>(data, data + serializer.getCurrentBufferSize());
}

/// Restores the bodies of a world that was built as the saved one.
///
/// @param file the importer writes into it
inline void restoreFile(SavedWorld& saved, std::vector<char> file)
{
    btMultiBodyWorldImporter importer(&saved.world);
    importer.setImporterFlags(eRESTORE_EXISTING_OBJECTS);
    ASSERT_TRUE(importer.loadFileFromMemory(file.data(), static_cast<int>(file.size())));
    // The importer sets world transforms only.
    for (const auto& body : saved.bodies)
        body->setCenterOfMassTransform(body->getWorldTransform());
}
}  // namespace cullet::test
