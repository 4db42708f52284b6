// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/kept_triangles.h"

#include "cullet/plugin/core/mix_bits.h"
#include "cullet/plugin/mesh/triangle_source.h"
#include "cullet/plugin/queries/mesh_queries.h"
#include "cullet/plugin/queries/mesh_target.h"

#include <cstddef>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
void TriangleHash::add(const btVector3* corners, int part, int index) noexcept
{
    struct
    {
        btScalar coordinates[9];
        std::int32_t ids[sizeof(btScalar) == 4 ? 3 : 2];
    } all = {};
    for (int c = 0; c < 3; ++c)
        std::memcpy(all.coordinates + 3 * c, corners[c].m_floats, 3 * sizeof(btScalar));
    all.ids[0] = part;
    all.ids[1] = index;
    constexpr std::size_t kWords = sizeof(all) / sizeof(std::uint64_t);
    static_assert(sizeof(all) % 16 == 0, "words in pairs");
    std::uint64_t words[kWords], sum = 0;
    std::memcpy(words, &all, sizeof(all));
    for (std::size_t i = 0; i < kWords; i += 2)
        sum += mixBits(words[i] ^ i, words[i + 1]);
    m_value = mixBits(m_value, sum);
}

ConstantTriangles ConstantTriangles::of(const btConcaveShape& mesh)
{
    const MeshTarget target = meshTargetOf(mesh);
    if (target.mesh == nullptr)
        return {};
    return {target.mesh->serial(), target.isScaled ? mesh.getLocalScaling() : btVector3(1, 1, 1)};
}

bool ConstantTriangles::operator==(const ConstantTriangles& other) const noexcept
{
    return serial == other.serial && scale.x() == other.scale.x() && scale.y() == other.scale.y() &&
           scale.z() == other.scale.z();
}

bool KeptMeshContacts::haveTrianglesOf(const btConcaveShape& mesh) const
{
    if (m_constant.serial != 0 && ConstantTriangles::of(mesh) == m_constant)
        return true;
    if (!m_hasTriangles)
        return false;
    TriangleHash hash;
    forEachTriangle(mesh, hash, m_low, m_high);
    return hash.value() == m_hash;
}

void KeptMeshContacts::setTriangles(const btConcaveShape& mesh, const btVector3& low, const btVector3& high,
                                    const TriangleHash* hash) noexcept
{
    m_constant = ConstantTriangles::of(mesh);
    m_low = low;
    m_high = high;
    m_hasTriangles = hash != nullptr;
    if (m_hasTriangles)
        m_hash = hash->value();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
