// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/kept_triangles.h"

#include "cullet/plugin/mesh/triangle_source.h"

#include <cstddef>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// All bits of both numbers affect all bits of the result.
std::uint64_t mix(std::uint64_t a, std::uint64_t b) noexcept
{
    __extension__ using Wide = unsigned __int128;
    const Wide product = Wide(a) * b;
    return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

constexpr std::uint64_t kOdd[] = {0x9e3779b97f4a7c15, 0xa0761d6478bd642f, 0xe7037ed1a0b428db};
}  // namespace

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
        sum += mix(words[i] ^ kOdd[0] ^ i, words[i + 1] ^ kOdd[1]);
    m_value = mix(m_value ^ kOdd[2], sum ^ kOdd[0]);
}

bool KeptMeshContacts::haveTrianglesOf(const btConcaveShape& mesh) const
{
    if (!m_hasTriangles)
        return false;
    TriangleHash hash;
    forEachTriangle(mesh, hash, m_low, m_high);
    return hash.value() == m_hash;
}

void KeptMeshContacts::setTriangles(const btVector3& low, const btVector3& high,
                                    const TriangleHash& hash) noexcept
{
    m_low = low;
    m_high = high;
    m_hash = hash.value();
    m_hasTriangles = true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
