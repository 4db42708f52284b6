// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/film/recording_film.h"

#include "cullet/demos/recording/recording_file.h"
#include "cullet/demos/render/film/world_filmer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <thread>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
bool isSameBox(const StreamBox& a, const StreamBox& b)
{
    return std::memcmp(&a, &b, sizeof a) == 0;
}

/// Finds the boxes that change after their first frame, in order of creation, since ids are reused. In the first frame
/// Bullet sets each box twice, the second time a little larger.
std::vector<bool> findMovers(const std::string& path)
{
    RecordingFile file(path);
    std::vector<bool> moves;
    std::vector<std::size_t> numbers;  // by id
    std::vector<StreamBox> boxes;      // by id
    std::vector<BoxEvent> events;
    while (file.nextFrame(events))
    {
        const std::size_t known = moves.size();
        for (const BoxEvent& event : events)
        {
            if (event.kind == BoxEvent::Kind::Create)
            {
                numbers.resize(std::max<std::size_t>(numbers.size(), event.id + 1));
                boxes.resize(numbers.size());
                numbers[event.id] = moves.size();
                boxes[event.id] = event.box;
                moves.push_back(false);
            }
            else if (event.kind == BoxEvent::Kind::Set && numbers[event.id] >= known)
                boxes[event.id] = event.box;
            else if (event.kind == BoxEvent::Kind::Set && !isSameBox(boxes[event.id], event.box))
                moves[numbers[event.id]] = true;
        }
    }
    return moves;
}

/// The boxes of a recording in a broad phase, and their looks.
class RecordingFilmer
{
public:
    RecordingFilmer(Film& film, const std::string& path, const DebugDrawOptions& overlay)
        : m_film(film), m_overlay(overlay), m_moves(findMovers(path))
    {
        film.bodyCount = static_cast<std::uint32_t>(m_moves.size());
        m_proxies.resize(m_moves.size());
        m_hasChanged.resize(m_moves.size());
        m_looks = FilmState(film).bodies();
    }

    ~RecordingFilmer()
    {
        for (btBroadphaseProxy* proxy : m_proxies)
        {
            if (proxy != nullptr)
                m_broadphase.destroyProxy(proxy, nullptr);
        }
    }
    RecordingFilmer(const RecordingFilmer&) = delete;
    RecordingFilmer& operator=(const RecordingFilmer&) = delete;

    void apply(const std::vector<BoxEvent>& events)
    {
        std::fill(m_hasChanged.begin(), m_hasChanged.end(), false);
        for (const BoxEvent& event : events)
            apply(event);
        m_broadphase.calculateOverlappingPairs(nullptr);
    }

    void shoot(double time)
    {
        FilmFrame frame;
        frame.time = time;
        const std::vector<bool> isPaired = findPaired();
        for (std::uint32_t body = 0; body < m_film.bodyCount; ++body)
        {
            const BodyChange look = lookAt(body, isPaired[body]);
            if (look.state == m_looks[body].state && look.pose.position == m_looks[body].pose.position &&
                look.pose.scale == m_looks[body].pose.scale)
                continue;
            m_looks[body] = look;
            frame.changes.push_back(look);
        }
        if (m_overlay.boxes || m_overlay.cells || m_overlay.pairs)
            frame.lines = drawnLines(m_broadphase, m_overlay);
        m_film.frames.push_back(std::move(frame));
    }

    FilmSource source() const
    {
        FilmSource source;
        const BroadphaseStats stats = m_broadphase.stats();
        source.backend = stats.backendName;
        source.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
        source.pairs = stats.pairs;
        source.hash = 0xcbf29ce484222325ull;
        for (const btBroadphaseProxy* proxy : m_proxies)
        {
            if (proxy == nullptr)
                continue;
            hashScalars(source.hash, proxy->m_aabbMin);
            hashScalars(source.hash, proxy->m_aabbMax);
        }
        return source;
    }

private:
    static btVector3 toVector(const double* numbers)
    {
        return btVector3(btScalar(numbers[0]), btScalar(numbers[1]), btScalar(numbers[2]));
    }

    void apply(const BoxEvent& event)
    {
        if (event.kind == BoxEvent::Kind::Create)
        {
            m_numbers.resize(std::max<std::size_t>(m_numbers.size(), event.id + 1));
            m_numbers[event.id] = m_created++;
        }
        const std::uint32_t body = m_numbers[event.id];
        btBroadphaseProxy*& proxy = m_proxies[body];
        const btVector3 min = toVector(event.box.min), max = toVector(event.box.max);
        switch (event.kind)
        {
            case BoxEvent::Kind::Create:
                proxy = m_broadphase.createProxy(min, max, 0, nullptr, event.group, event.mask, nullptr);
                proxy->m_clientObject = &m_proxies[body];
                break;
            case BoxEvent::Kind::Destroy:
                m_broadphase.destroyProxy(proxy, nullptr);
                proxy = nullptr;
                break;
            case BoxEvent::Kind::Set:
                m_hasChanged[body] = m_hasChanged[body] || proxy->m_aabbMin != min || proxy->m_aabbMax != max;
                m_broadphase.setAabb(proxy, min, max, nullptr);
                break;
            case BoxEvent::Kind::Filter:
                proxy->m_collisionFilterGroup = event.group;
                proxy->m_collisionFilterMask = event.mask;
                break;
            case BoxEvent::Kind::Frame:
                break;
        }
    }

    std::vector<bool> findPaired() const
    {
        std::vector<bool> isPaired(m_proxies.size());
        const btOverlappingPairCache& cache = *m_broadphase.getOverlappingPairCache();
        const btBroadphasePair* pairs = cache.getOverlappingPairArrayPtr();
        for (int i = 0; i < cache.getNumOverlappingPairs(); ++i)
        {
            for (const btBroadphaseProxy* proxy : {pairs[i].m_pProxy0, pairs[i].m_pProxy1})
                isPaired[static_cast<btBroadphaseProxy* const*>(proxy->m_clientObject) - m_proxies.data()] =
                    true;
        }
        return isPaired;
    }

    BodyState stateOf(std::uint32_t body, bool isPaired) const
    {
        if (!m_moves[body])
            return BodyState::Static;
        if (!m_hasChanged[body] && m_looks[body].state != BodyState::Hidden)
            return BodyState::Asleep;
        return isPaired ? BodyState::Near : BodyState::Separated;
    }

    BodyChange lookAt(std::uint32_t body, bool isPaired) const
    {
        constexpr float kEndless = 0x1p40f;
        BodyChange look = m_looks[body];
        look.mesh = Film::kCube;
        const btBroadphaseProxy* const proxy = m_proxies[body];
        look.state = BodyState::Hidden;
        if (proxy == nullptr)
            return look;
        const Eigen::Vector3f sides = toEigen(proxy->m_aabbMax - proxy->m_aabbMin);
        if (!(sides.minCoeff() >= 0) || !(sides.maxCoeff() < kEndless))
            return look;
        look.state = stateOf(body, isPaired);
        look.pose.scale = sides;
        look.pose.position = toEigen((proxy->m_aabbMax + proxy->m_aabbMin) / 2);
        return look;
    }

    Film& m_film;
    DebugDrawOptions m_overlay;
    std::vector<bool> m_moves;  ///< [bodies] in order of creation, like all members below
    Broadphase m_broadphase;
    std::vector<btBroadphaseProxy*> m_proxies;  ///< null: no box
    std::vector<bool> m_hasChanged;             ///< since the previous frame
    std::vector<BodyChange> m_looks;
    std::vector<std::uint32_t> m_numbers;  ///< id -> body
    std::uint32_t m_created = 0;
};
}  // namespace

Film filmRecording(const std::string& path, const SceneFilmOptions& options,
                   const std::function<bool(int)>& step)
{
    RecordingFile(path).summarise();
    Film film;
    RecordingFilmer filmer(film, path, options.overlay);
    RecordingFile file(path);
    TraceLane trace(options.trace, filmer.source().backend);
    std::vector<BoxEvent> events;
    for (int number = 0; number <= options.steps && file.nextFrame(events) && step(number); ++number)
    {
        const auto start = TraceFile::Clock::now();
        filmer.apply(events);
        trace.add("frame", start, TraceFile::Clock::now());
        if (number >= options.start && (number - options.start) % options.every == 0)
            filmer.shoot((number - options.start) * static_cast<double>(options.world.dt));
    }
    film.source = filmer.source();
    return film;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
