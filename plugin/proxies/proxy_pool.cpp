// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/proxies/proxy_pool.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
Proxy* ProxyPool::make(std::uint32_t row)
{
    while (row / kProxiesPerChunk >= m_chunks.size())
    {
        auto chunk = std::make_unique<Chunk>();
        chunk->firstRow = static_cast<std::uint32_t>(m_chunks.size()) * kProxiesPerChunk;
        m_chunks.push_back(std::move(chunk));
    }
    return at(row);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
