// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/image/gltf.h"

#include "cullet/demos/program/exit_code.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace cullet
{
namespace
{
using Json = nlohmann::ordered_json;

// Numbers of the specification (glTF 2.0, sections 3.6.2 and 5.11).
constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

/// The binary half of the file, and the views and accessors into it.
class Binary
{
public:
    /// Appends values and returns the number of their accessor.
    ///
    /// @param width    numbers of an element: 1, 3 or 4
    /// @param target   kind of buffer, 0 for data other than vertices and indices
    /// @param isRanged whether to write min and max
    template <class Number>
    int add(const std::vector<Number>& values, int width, int target, bool isRanged)
    {
        static_assert(sizeof(Number) == 4);
        Json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", 4 * values.size()}};
        if (target != 0)
            view["target"] = target;
        views.push_back(std::move(view));
        const auto* first = reinterpret_cast<const char*>(values.data());
        bytes.insert(bytes.end(), first, first + 4 * values.size());
        const char* const type = width == 1 ? "SCALAR" : width == 3 ? "VEC3" : "VEC4";
        Json accessor = {{"bufferView", views.size() - 1},
                         {"componentType", std::is_same_v<Number, float> ? kFloat : kUnsignedInt},
                         {"count", values.size() / width},
                         {"type", type}};
        if (isRanged)
            addRange(values, width, accessor);
        accessors.push_back(std::move(accessor));
        return static_cast<int>(accessors.size()) - 1;
    }

    std::vector<char> bytes;
    Json views = Json::array();
    Json accessors = Json::array();

private:
    template <class Number>
    static void addRange(const std::vector<Number>& values, int width, Json& accessor)
    {
        std::vector<Number> min(values.begin(), values.begin() + width), max = min;
        for (std::size_t i = 0; i < values.size(); ++i)
        {
            min[i % width] = std::min(min[i % width], values[i]);
            max[i % width] = std::max(max[i % width], values[i]);
        }
        accessor["min"] = min;
        accessor["max"] = max;
    }
};

std::vector<float> flatten(const std::vector<Eigen::Vector3f>& vectors)
{
    std::vector<float> numbers;
    numbers.reserve(3 * vectors.size());
    for (const Eigen::Vector3f& v : vectors)
        numbers.insert(numbers.end(), {v.x(), v.y(), v.z()});
    return numbers;
}

Json toJson(const Eigen::Vector3f& v)
{
    return {v.x(), v.y(), v.z()};
}

Json toJson(const Eigen::Vector4f& v)
{
    return {v.x(), v.y(), v.z(), v.w()};
}

/// glTF requires linear colours.
Json materialOf(BodyState state)
{
    const StateLook& look = lookOf(state);
    Json color = Json::array();
    for (int channel = 0; channel < 3; ++channel)
        color.push_back(std::pow(look.color[channel], 2.2f));
    color.push_back(look.color.w());
    Json material = {{"name", look.name},
                     {"pbrMetallicRoughness",
                      {{"baseColorFactor", color}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.7}}},
                     {"doubleSided", true}};
    if (look.color.w() < 1)
        material["alphaMode"] = "BLEND";
    return material;
}

/// One body with one mesh over all frames; scale 0 in frames without it.
struct Track
{
    BodyState state = BodyState::Hidden;  ///< the last one that is not hidden
    std::vector<BodyPose> poses;          ///< [frames]
};

bool differ(const std::vector<BodyPose>& poses, bool (*isSame)(const BodyPose&, const BodyPose&))
{
    return std::any_of(poses.begin(), poses.end(),
                       [&](const BodyPose& pose) { return !isSame(pose, poses[0]); });
}

class GltfWriter
{
public:
    GltfWriter(const Film& film, std::string binaryName) : m_film(film), m_binaryName(std::move(binaryName))
    {
        for (int state = 0; state < kBodyStateCount; ++state)
            m_materials.push_back(materialOf(static_cast<BodyState>(state)));
        m_accessorsOf.resize(film.meshes.size());
        collectTracks();
        std::vector<float> times;
        for (const FilmFrame& frame : film.frames)
            times.push_back(static_cast<float>(frame.time));
        if (times.size() > 1)
            m_times = m_binary.add(times, 1, 0, true);
        for (const auto& [key, track] : m_tracks)
            addNode(key.first, key.second, track);
    }

    Json document() const
    {
        Json nodes = Json::array();
        for (std::size_t i = 0; i < m_nodes.size(); ++i)
            nodes.push_back(i);
        Json document = {{"asset", {{"version", "2.0"}, {"generator", "cullet"}}},
                         {"scene", 0},
                         {"scenes", {{{"nodes", nodes}}}},
                         {"nodes", m_nodes},
                         {"meshes", m_meshes},
                         {"materials", m_materials},
                         {"accessors", m_binary.accessors},
                         {"bufferViews", m_binary.views},
                         {"buffers", {{{"uri", m_binaryName}, {"byteLength", m_binary.bytes.size()}}}}};
        if (!m_channels.empty())
            document["animations"] = {
                {{"name", "frames"}, {"channels", m_channels}, {"samplers", m_samplers}}};
        return document;
    }

    const std::vector<char>& bytes() const { return m_binary.bytes; }

private:
    using Key = std::pair<std::uint32_t, std::uint32_t>;  // body, mesh

    /// Vertex and index accessors of a mesh.
    struct MeshAccessors
    {
        int positions = -1, normals = -1, triangles = -1;
    };

    void collectTracks()
    {
        FilmState state(m_film);
        const BodyPose absent{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), {0, 0, 0, 1}};
        for (std::size_t frame = 0; frame < m_film.frames.size(); ++frame)
        {
            state.apply(m_film.frames[frame]);
            for (const BodyChange& body : state.bodies())
            {
                if (body.state == BodyState::Hidden || m_film.meshes[body.mesh].triangles.empty())
                    continue;
                Track& track = m_tracks[{body.body, body.mesh}];
                track.poses.resize(m_film.frames.size(), absent);
                track.poses[frame] = body.pose;
                track.state = body.state;
            }
        }
    }

    int meshOf(std::uint32_t mesh, BodyState state)
    {
        const auto [found, isNew] =
            m_meshOf.try_emplace({mesh, static_cast<int>(state)}, static_cast<int>(m_meshes.size()));
        if (!isNew)
            return found->second;
        MeshAccessors& own = m_accessorsOf[mesh];
        if (own.positions < 0)
        {
            const DrawMesh& data = m_film.meshes[mesh];
            own.positions = m_binary.add(flatten(data.positions), 3, kArrayBuffer, true);
            own.normals = m_binary.add(flatten(data.normals), 3, kArrayBuffer, false);
            own.triangles = m_binary.add(data.triangles, 1, kElementArrayBuffer, false);
        }
        m_meshes.push_back({{"primitives",
                             {{{"attributes", {{"POSITION", own.positions}, {"NORMAL", own.normals}}},
                               {"indices", own.triangles},
                               {"material", static_cast<int>(state)}}}}});
        return found->second;
    }

    void addNode(std::uint32_t body, std::uint32_t mesh, const Track& track)
    {
        const BodyPose& first = track.poses[0];
        m_nodes.push_back({{"name", "body " + std::to_string(body)},
                           {"mesh", meshOf(mesh, track.state)},
                           {"translation", toJson(first.position)},
                           {"rotation", toJson(first.rotation)},
                           {"scale", toJson(first.scale)}});
        const auto moves = [](const BodyPose& a, const BodyPose& b) { return a.position == b.position; };
        const auto turns = [](const BodyPose& a, const BodyPose& b) { return a.rotation == b.rotation; };
        const auto scales = [](const BodyPose& a, const BodyPose& b) { return a.scale == b.scale; };
        if (differ(track.poses, moves))
            addChannel("translation", "LINEAR", positionsOf(track), 3);
        if (differ(track.poses, turns))
            addChannel("rotation", "LINEAR", rotationsOf(track), 4);
        if (differ(track.poses, scales))
            addChannel("scale", "STEP", scalesOf(track), 3);
    }

    void addChannel(const char* path, const char* interpolation, const std::vector<float>& values, int width)
    {
        m_channels.push_back(
            {{"sampler", m_samplers.size()}, {"target", {{"node", m_nodes.size() - 1}, {"path", path}}}});
        m_samplers.push_back({{"input", m_times},
                              {"output", m_binary.add(values, width, 0, false)},
                              {"interpolation", interpolation}});
    }

    static std::vector<float> positionsOf(const Track& track)
    {
        std::vector<float> values;
        for (const BodyPose& pose : track.poses)
            values.insert(values.end(), pose.position.data(), pose.position.data() + 3);
        return values;
    }

    static std::vector<float> scalesOf(const Track& track)
    {
        std::vector<float> values;
        for (const BodyPose& pose : track.poses)
            values.insert(values.end(), pose.scale.data(), pose.scale.data() + 3);
        return values;
    }

    /// q and -q are the same rotation; viewers interpolate along the short arc only if the signs of neighbours agree.
    static std::vector<float> rotationsOf(const Track& track)
    {
        std::vector<float> values;
        Eigen::Vector4f before = track.poses[0].rotation;
        for (const BodyPose& pose : track.poses)
        {
            const Eigen::Vector4f unit = pose.rotation.normalized();
            before = unit.dot(before) < 0 ? Eigen::Vector4f(-unit) : unit;
            values.insert(values.end(), before.data(), before.data() + 4);
        }
        return values;
    }

    const Film& m_film;
    std::string m_binaryName;
    std::map<Key, Track> m_tracks;
    std::map<std::pair<std::uint32_t, int>, int> m_meshOf;
    std::vector<MeshAccessors> m_accessorsOf;
    Binary m_binary;
    int m_times = -1;
    Json m_nodes = Json::array(), m_meshes = Json::array(), m_materials = Json::array();
    Json m_channels = Json::array(), m_samplers = Json::array();
};

void writeFile(const std::string& path, const char* data, std::size_t size)
{
    std::ofstream file(path, std::ios::binary);
    file.write(data, static_cast<std::streamsize>(size));
    file.flush();
    if (!file)
        throw ProgramError(kExitOutput, "cannot write " + path + ": " + std::strerror(errno));
}
}  // namespace

void checkGltf(const std::string& path)
{
    if (std::filesystem::path(path).extension() != ".gltf")
        throw std::invalid_argument("--gltf takes a file that ends in .gltf, not " + path);
}

void writeGltf(const Film& film, const std::string& path)
{
    checkGltf(path);
    std::filesystem::path binary(path);
    binary.replace_extension(".bin");
    const GltfWriter writer(film, binary.filename().string());
    const std::string text = writer.document().dump();
    writeFile(path, text.data(), text.size());
    writeFile(binary.string(), writer.bytes().data(), writer.bytes().size());
}
}  // namespace cullet
