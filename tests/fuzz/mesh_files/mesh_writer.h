// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/mesh_hull.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

/// Valid mesh files of a few vertices, in the formats that people have.
namespace cullet::test
{
enum class MeshFormat : std::uint8_t
{
    Obj,
    Off,
    AsciiPly,
    BinaryPly,
    AsciiStl,
    BinaryStl,
    Collada,
    kCount
};

inline const char* extensionOf(MeshFormat format)
{
    static const char* const kExtensions[] = {"obj", "off", "ply", "ply", "stl", "stl", "dae"};
    return kExtensions[static_cast<std::size_t>(format)];
}

/// Writes a fan of triangles, so that every vertex belongs to one.
class MeshWriter
{
public:
    /// @param vertices at least three
    explicit MeshWriter(const std::vector<Point>& vertices) : m_vertices(vertices) {}

    std::string write(MeshFormat format) const
    {
        switch (format)
        {
            case MeshFormat::Obj:
                return lines("v ", m_vertices) + faces("f ", 1);
            case MeshFormat::Off:
                return "OFF\n" + counts(" ") + " 0\n" + lines("", m_vertices) + faces("3 ", 0);
            case MeshFormat::AsciiPly:
                return plyHead("ascii") + lines("", m_vertices) + faces("3 ", 0);
            case MeshFormat::BinaryPly:
                return plyHead("binary_little_endian") + binaryPly();
            case MeshFormat::AsciiStl:
                return asciiStl();
            case MeshFormat::BinaryStl:
                return binaryStl();
            default:
                return collada();
        }
    }

private:
    std::size_t faceCount() const { return m_vertices.size() - 2; }

    static std::string text(const Point& p)
    {
        char line[96];
        std::snprintf(line, sizeof line, "%.9g %.9g %.9g", double(p[0]), double(p[1]), double(p[2]));
        return line;
    }

    static std::string lines(const char* head, const std::vector<Point>& points)
    {
        std::string all;
        for (const Point& p : points)
            all += head + text(p) + '\n';
        return all;
    }

    std::string faces(const char* head, std::size_t first) const
    {
        std::string all;
        for (std::size_t i = 0; i < faceCount(); ++i)
            all += head + std::to_string(first) + ' ' + std::to_string(first + i + 1) + ' ' +
                   std::to_string(first + i + 2) + '\n';
        return all;
    }

    std::string counts(const char* between) const
    {
        return std::to_string(m_vertices.size()) + between + std::to_string(faceCount());
    }

    std::string plyHead(const char* format) const
    {
        return std::string("ply\nformat ") + format + " 1.0\nelement vertex " +
               counts("\nproperty float x\nproperty float y\nproperty float z\nelement face ") +
               "\nproperty list uchar int vertex_indices\nend_header\n";
    }

    template <class T>
    static void append(std::string& out, const T& value)
    {
        char bytes[sizeof(T)];
        std::memcpy(bytes, &value, sizeof value);
        out.append(bytes, sizeof value);
    }

    std::string binaryPly() const
    {
        std::string out;
        for (const Point& p : m_vertices)
            append(out, p);
        for (std::size_t i = 0; i < faceCount(); ++i)
        {
            append(out, std::uint8_t{3});
            append(out, std::array<std::int32_t, 3>{0, int(i) + 1, int(i) + 2});
        }
        return out;
    }

    std::string asciiStl() const
    {
        std::string out = "solid fuzz\n";
        for (std::size_t i = 0; i < faceCount(); ++i)
            out += "facet normal 0 0 1\nouter loop\n" +
                   lines("vertex ", {m_vertices[0], m_vertices[i + 1], m_vertices[i + 2]}) +
                   "endloop\nendfacet\n";
        return out + "endsolid fuzz\n";
    }

    std::string binaryStl() const
    {
        std::string out(80, ' ');
        append(out, static_cast<std::uint32_t>(faceCount()));
        for (std::size_t i = 0; i < faceCount(); ++i)
        {
            append(out, Point{0, 0, 1});
            for (const std::size_t corner : {std::size_t{0}, i + 1, i + 2})
                append(out, m_vertices[corner]);
            append(out, std::uint16_t{0});
        }
        return out;
    }

    std::string collada() const
    {
        std::string positions, indices;
        for (const Point& p : m_vertices)
            positions += text(p) + ' ';
        for (std::size_t i = 0; i < faceCount(); ++i)
            indices += "0 " + std::to_string(i + 1) + ' ' + std::to_string(i + 2) + ' ';
        const std::string count = std::to_string(m_vertices.size());
        return "<?xml version=\"1.0\"?>\n"
               "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
               "<asset><up_axis>Y_UP</up_axis></asset>\n"
               "<library_geometries><geometry id=\"g\"><mesh>\n<source id=\"p\"><float_array id=\"a\" "
               "count=\"" +
               std::to_string(3 * m_vertices.size()) + "\">" + positions +
               "</float_array>\n<technique_common><accessor source=\"#a\" count=\"" + count +
               "\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
               "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source>\n"
               "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>\n<triangles "
               "count=\"" +
               std::to_string(faceCount()) + "\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>" +
               indices +
               "</p></triangles>\n</mesh></geometry></library_geometries>\n"
               "<library_visual_scenes><visual_scene id=\"s\"><node id=\"n\"><instance_geometry "
               "url=\"#g\"/></node>"
               "</visual_scene></library_visual_scenes>\n<scene><instance_visual_scene url=\"#s\"/></scene>\n"
               "</COLLADA>\n";
    }

    const std::vector<Point>& m_vertices;
};
}  // namespace cullet::test
