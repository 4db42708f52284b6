// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/painter.h"

#include "cullet/demos/render/gl_program.h"
#include "cullet/demos/render/shaders.h"
#include "cullet/demos/render/view_math.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <stdexcept>

namespace cullet
{
namespace
{
constexpr int kSamples = 3;  // along each side of a pixel
constexpr int kShadowSize = 2048;
constexpr float kWallOpacity = 0.06f;

/// Data of a body in graphics memory.
struct Instance
{
    float place[3], scale[3], rotation[4], color[4], hasGrid;
};

struct GpuMesh
{
    GLuint array = 0;
    GLsizei indexCount = 0;
};

struct ContextCloser
{
    void operator()(OSMesaContext context) const { OSMesaDestroyContext(context); }
};
using Context = std::unique_ptr<std::remove_pointer_t<OSMesaContext>, ContextCloser>;

Context makeContext(std::vector<std::uint8_t>& buffer, int width, int height)
{
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              32,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
    Context context(OSMesaCreateContextAttribs(attributes, nullptr));
    if (context == nullptr ||
        OSMesaMakeCurrent(context.get(), buffer.data(), GL_UNSIGNED_BYTE, width, height) != GL_TRUE)
        throw std::runtime_error("OSMesa gives no OpenGL 3.3 context");
    OSMesaPixelStore(OSMESA_Y_UP, 0);
    return context;
}

/// A different shade for each body, so that neighbours are distinguishable.
float shadeOf(std::uint32_t body)
{
    const std::uint32_t mixed = (body + 1) * 2654435769u;
    return 0.92f + 0.16f * static_cast<float>(mixed >> 16) / 65536.0f;
}

}  // namespace

struct Painter::Parts
{
    Parts(const Film& theFilm, int theWidth, int theHeight);

    void makeShadowMap();
    const GpuMesh& upload(std::uint32_t mesh);
    void sortBodies(const FilmState& state, const Camera& camera);
    void drawBodies(const std::vector<std::vector<Instance>>& byMesh);
    void drawShadows(const Eigen::Matrix4f& toShadow);
    void drawScene(const Camera& camera, const Eigen::Matrix4f& toScreen, const Eigen::Matrix4f& toShadow);
    void drawLines(const std::vector<FilmLine>& lines, const Eigen::Matrix4f& toScreen);
    Image readImage() const;

    const Film& film;
    int width, height;  ///< in samples
    std::vector<std::uint8_t> buffer;
    Context context;
    GlProgram bodyProgram, depthProgram, backdropProgram, lineProgram;
    GLuint emptyArray = 0, lineArray = 0, lineBuffer = 0, instanceBuffer = 0;
    GLuint shadowMap = 0, shadowFrame = 0;
    std::vector<GpuMesh> meshes;
    std::vector<std::vector<Instance>> solid, translucent, casters;  ///< by mesh; solid ones without casters
};

Painter::Parts::Parts(const Film& theFilm, int theWidth, int theHeight)
    : film(theFilm),
      width(theWidth * kSamples),
      height(theHeight * kSamples),
      buffer(std::size_t(width) * height * 4),
      context(makeContext(buffer, width, height)),
      bodyProgram(kBodyVertexShader, std::string(kBackdrop) + kBodyFragmentShader),
      depthProgram(kBodyVertexShader, kDepthFragmentShader),
      backdropProgram(kBackdropVertexShader, std::string(kBackdrop) + kBackdropFragmentShader),
      lineProgram(kLineVertexShader, kLineFragmentShader)
{
    glGenVertexArrays(1, &emptyArray);
    glGenVertexArrays(1, &lineArray);
    glGenBuffers(1, &lineBuffer);
    glGenBuffers(1, &instanceBuffer);
    makeShadowMap();
}

void Painter::Parts::makeShadowMap()
{
    glGenTextures(1, &shadowMap);
    glBindTexture(GL_TEXTURE_2D, shadowMap);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, kShadowSize, kShadowSize, 0, GL_DEPTH_COMPONENT,
                 GL_FLOAT, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glGenFramebuffers(1, &shadowFrame);
    glBindFramebuffer(GL_FRAMEBUFFER, shadowFrame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadowMap, 0);
    glDrawBuffer(GL_NONE);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

const GpuMesh& Painter::Parts::upload(std::uint32_t number)
{
    if (meshes.size() <= number)
        meshes.resize(film.meshes.size());
    GpuMesh& gpu = meshes[number];
    if (gpu.array != 0)
        return gpu;
    const DrawMesh& mesh = film.meshes[number];
    const auto size = static_cast<GLsizeiptr>(mesh.positions.size() * sizeof(Eigen::Vector3f));
    GLuint buffers[2];
    glGenVertexArrays(1, &gpu.array);
    glGenBuffers(2, buffers);
    glBindVertexArray(gpu.array);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    glBufferData(GL_ARRAY_BUFFER, 2 * size, nullptr, GL_STATIC_DRAW);
    glBufferSubData(GL_ARRAY_BUFFER, 0, size, mesh.positions.data());
    glBufferSubData(GL_ARRAY_BUFFER, size, size, mesh.normals.data());
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, 0, reinterpret_cast<const void*>(size));
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(mesh.triangles.size() * sizeof(std::uint32_t)),
                 mesh.triangles.data(), GL_STATIC_DRAW);
    for (GLuint attribute = 0; attribute < 7; ++attribute)
    {
        glEnableVertexAttribArray(attribute);
        glVertexAttribDivisor(attribute, attribute < 2 ? 0 : 1);
    }
    gpu.indexCount = static_cast<GLsizei>(mesh.triangles.size());
    return gpu;
}

void Painter::Parts::sortBodies(const FilmState& state, const Camera& camera)
{
    for (auto* lists : {&solid, &translucent, &casters})
    {
        lists->resize(film.meshes.size());
        for (std::vector<Instance>& list : *lists)
            list.clear();
    }
    for (const BodyChange& body : state.bodies())
    {
        if (body.state == BodyState::Hidden)
            continue;
        const bool isStatic = body.state == BodyState::Static;
        Eigen::Vector4f color = lookOf(body.state).color;
        if (!isStatic)
            color.head<3>() = (color.head<3>() * shadeOf(body.body)).cwiseMin(1.0f);
        if (isStatic && body.mesh == Film::kCube &&
            (isWall(body.pose, camera) || isInTheWay(body.pose, camera)))
            color.w() = kWallOpacity;
        Instance instance{};
        std::copy_n(body.pose.position.data(), 3, instance.place);
        std::copy_n(body.pose.scale.data(), 3, instance.scale);
        std::copy_n(body.pose.rotation.data(), 4, instance.rotation);
        std::copy_n(color.data(), 4, instance.color);
        instance.hasGrid = isStatic ? 1.0f : 0.0f;
        // Floors and walls would shade the whole scene.
        const bool casts = !isStatic || body.mesh != Film::kCube;
        (color.w() < 1 ? translucent : casts ? casters : solid)[body.mesh].push_back(instance);
    }
}

void Painter::Parts::drawBodies(const std::vector<std::vector<Instance>>& byMesh)
{
    for (std::uint32_t mesh = 0; mesh < byMesh.size(); ++mesh)
    {
        const std::vector<Instance>& instances = byMesh[mesh];
        if (instances.empty())
            continue;
        const GpuMesh& gpu = upload(mesh);
        glBindVertexArray(gpu.array);
        glBindBuffer(GL_ARRAY_BUFFER, instanceBuffer);
        glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(instances.size() * sizeof(Instance)),
                     instances.data(), GL_STREAM_DRAW);
        const auto point = [](GLuint attribute, GLint count, std::size_t offset)
        {
            glVertexAttribPointer(attribute, count, GL_FLOAT, GL_FALSE, sizeof(Instance),
                                  reinterpret_cast<const void*>(offset));
        };
        point(2, 3, offsetof(Instance, place));
        point(3, 3, offsetof(Instance, scale));
        point(4, 4, offsetof(Instance, rotation));
        point(5, 4, offsetof(Instance, color));
        point(6, 1, offsetof(Instance, hasGrid));
        glDrawElementsInstanced(GL_TRIANGLES, gpu.indexCount, GL_UNSIGNED_INT, nullptr,
                                static_cast<GLsizei>(instances.size()));
    }
}

void Painter::Parts::drawShadows(const Eigen::Matrix4f& toShadow)
{
    glBindFramebuffer(GL_FRAMEBUFFER, shadowFrame);
    glViewport(0, 0, kShadowSize, kShadowSize);
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_DEPTH_CLAMP);
    glDepthMask(GL_TRUE);
    glClear(GL_DEPTH_BUFFER_BIT);
    depthProgram.use();
    depthProgram.set("toScreen", toShadow);
    drawBodies(casters);
    glDisable(GL_DEPTH_CLAMP);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void Painter::Parts::drawScene(const Camera& camera, const Eigen::Matrix4f& toScreen,
                               const Eigen::Matrix4f& toShadow)
{
    glViewport(0, 0, width, height);
    glClear(GL_DEPTH_BUFFER_BIT);
    glDisable(GL_DEPTH_TEST);
    backdropProgram.use();
    backdropProgram.set("height", static_cast<float>(height));
    glBindVertexArray(emptyArray);
    glDrawArrays(GL_TRIANGLES, 0, 3);

    Eigen::Vector3f u, v;
    spanHorizon(film.up, u, v);
    glEnable(GL_DEPTH_TEST);
    bodyProgram.use();
    bodyProgram.set("height", static_cast<float>(height));
    bodyProgram.set("toScreen", toScreen);
    bodyProgram.set("toShadow", toShadow);
    bodyProgram.set("sun", sunDirection(film.up));
    bodyProgram.set("up", film.up);
    bodyProgram.set("eye", camera.eye);
    bodyProgram.set("target", camera.target);
    bodyProgram.set("radius", camera.radius);
    bodyProgram.set("shadowTexel", 2 * kShadowReach * camera.radius / kShadowSize);
    bodyProgram.set("gridStep", gridStepFor(camera.radius));
    bodyProgram.set("gridU", u);
    bodyProgram.set("gridV", v);
    drawBodies(solid);
    drawBodies(casters);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthMask(GL_FALSE);
    drawBodies(translucent);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
}

/// Draws lines over bodies; lines behind bodies are faint.
void Painter::Parts::drawLines(const std::vector<FilmLine>& lines, const Eigen::Matrix4f& toScreen)
{
    if (lines.empty())
        return;
    std::vector<float> data;
    for (const FilmLine& line : lines)
    {
        for (const Eigen::Vector3f* end : {&line.from, &line.to})
        {
            data.insert(data.end(), end->data(), end->data() + 3);
            data.insert(data.end(), line.color.data(), line.color.data() + 3);
        }
    }
    glBindVertexArray(lineArray);
    glBindBuffer(GL_ARRAY_BUFFER, lineBuffer);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(data.size() * sizeof(float)), data.data(),
                 GL_STREAM_DRAW);
    for (GLuint attribute = 0; attribute < 2; ++attribute)
    {
        glEnableVertexAttribArray(attribute);
        glVertexAttribPointer(attribute, 3, GL_FLOAT, GL_FALSE, 6 * sizeof(float),
                              reinterpret_cast<const void*>(attribute * 3 * sizeof(float)));
    }
    lineProgram.use();
    lineProgram.set("toScreen", toScreen);
    glLineWidth(1.25f * kSamples);
    glEnable(GL_BLEND);
    glDepthMask(GL_FALSE);
    for (const bool isHidden : {true, false})
    {
        lineProgram.set("opacity", isHidden ? 0.25f : 0.9f);
        glDepthFunc(isHidden ? GL_GREATER : GL_LEQUAL);
        glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(2 * lines.size()));
    }
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
}

Image Painter::Parts::readImage() const
{
    glFinish();
    Image image{width, height, {}};
    image.pixels.reserve(std::size_t(width) * height * 3);
    for (std::size_t pixel = 0; pixel < buffer.size(); pixel += 4)
        image.pixels.insert(image.pixels.end(), {buffer[pixel], buffer[pixel + 1], buffer[pixel + 2]});
    return shrink(image, kSamples);
}

Painter::Painter(const Film& film, int width, int height) : m(std::make_unique<Parts>(film, width, height)) {}

Painter::~Painter() = default;

Image Painter::paint(const FilmFrame& frame, const FilmState& state, const Camera& camera)
{
    OSMesaMakeCurrent(m->context.get(), m->buffer.data(), GL_UNSIGNED_BYTE, m->width, m->height);
    const float aspect = static_cast<float>(m->width) / static_cast<float>(m->height);
    const Eigen::Matrix4f toShadow = shadowMatrix(camera), toScreen = screenMatrix(camera, aspect);
    m->sortBodies(state, camera);
    m->drawShadows(toShadow);
    m->drawScene(camera, toScreen, toShadow);
    m->drawLines(frame.lines, toScreen);
    return m->readImage();
}

bool hasPainter()
{
    return true;
}
}  // namespace cullet
