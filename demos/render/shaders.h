// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

/// The shader programs of the painter, in GLSL 3.30.
namespace cullet
{
inline constexpr const char* kBodyVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) in vec3 scale;
layout(location = 4) in vec4 rotation;
layout(location = 5) in vec4 color;
layout(location = 6) in float hasGrid;
uniform mat4 toScreen;
out vec3 worldPosition;
out vec3 worldNormal;
flat out vec4 bodyColor;
flat out float bodyHasGrid;
vec3 turn(vec3 v) { return v + 2.0 * cross(rotation.xyz, cross(rotation.xyz, v) + rotation.w * v); }
void main()
{
    worldPosition = place + turn(scale * position);
    worldNormal = turn(normal / max(abs(scale), vec3(1e-12)) * sign(scale));
    bodyColor = color;
    bodyHasGrid = hasGrid;
    gl_Position = toScreen * vec4(worldPosition, 1.0);
}
)";

inline constexpr const char* kDepthFragmentShader = R"(#version 330 core
void main() {}
)";

/// Code shared by the body and the backdrop program.
inline constexpr const char* kBackdrop = R"(#version 330 core
uniform float height;
vec3 backdrop()
{
    float up = clamp(gl_FragCoord.y / height, 0.0, 1.0);
    return mix(vec3(0.93, 0.94, 0.96), vec3(0.80, 0.86, 0.93), up * up);
}
)";

inline constexpr const char* kBackdropVertexShader = R"(#version 330 core
void main()
{
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
}
)";

inline constexpr const char* kBackdropFragmentShader = R"(
out vec4 result;
void main() { result = vec4(backdrop(), 1.0); }
)";

inline constexpr const char* kBodyFragmentShader = R"(
in vec3 worldPosition;
in vec3 worldNormal;
flat in vec4 bodyColor;
flat in float bodyHasGrid;
uniform mat4 toShadow;
uniform sampler2DShadow shadowMap;
uniform vec3 sun;
uniform vec3 up;
uniform vec3 eye;
uniform vec3 target;
uniform float radius;
uniform float shadowTexel;
uniform float gridStep;
uniform vec3 gridU;
uniform vec3 gridV;
out vec4 result;

float lightAt(vec3 normal)
{
    vec4 place = toShadow * vec4(worldPosition + normal * shadowTexel * 2.5, 1.0);
    vec3 uv = place.xyz * 0.5 + 0.5;
    if (any(lessThan(uv, vec3(0.0))) || any(greaterThan(uv, vec3(1.0))))
        return 1.0;
    float step = 1.0 / float(textureSize(shadowMap, 0).x);
    float sum = 0.0;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            sum += texture(shadowMap, vec3(uv.xy + vec2(x, y) * step * 1.3, uv.z - 0.0006));
    return sum / 9.0;
}

float gridLine(float along)
{
    float cells = along / gridStep;
    float pixel = max(fwidth(cells), 1e-6);
    float line = 1.0 - smoothstep(0.5, 1.5, abs(fract(cells - 0.5) - 0.5) / pixel);
    return line * clamp(0.35 / pixel, 0.0, 1.0);
}

void main()
{
    vec3 normal = normalize(worldNormal);
    if (!gl_FrontFacing)
        normal = -normal;
    vec3 base = pow(bodyColor.rgb, vec3(2.2));
    float facing = dot(normal, up);
    if (bodyHasGrid > 0.5 && facing > 0.9)
        base *= 1.0 - 0.22 * max(gridLine(dot(worldPosition, gridU)), gridLine(dot(worldPosition, gridV)));
    vec3 toEye = normalize(eye - worldPosition);
    float direct = max(dot(normal, sun), 0.0);
    if (direct > 0.0)
        direct *= lightAt(normal);
    vec3 ambient = mix(vec3(0.30, 0.29, 0.28), vec3(0.50, 0.54, 0.60), facing * 0.5 + 0.5);
    float gloss = pow(max(dot(normal, normalize(sun + toEye)), 0.0), 40.0) * direct;
    vec3 color = base * (ambient + vec3(0.62, 0.60, 0.56) * direct) + vec3(0.05) * gloss * (1.0 - bodyHasGrid);
    color = pow(color, vec3(1.0 / 2.2));
    float far = bodyHasGrid * smoothstep(2.5, 9.0, distance(worldPosition, target) / radius);
    result = vec4(mix(color, backdrop(), far), bodyColor.a);
}
)";

inline constexpr const char* kLineVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
uniform mat4 toScreen;
uniform float opacity;
out vec4 lineColor;
void main()
{
    lineColor = vec4(color, opacity);
    gl_Position = toScreen * vec4(position, 1.0);
    gl_Position.z -= 1e-4 * gl_Position.w;
}
)";

inline constexpr const char* kLineFragmentShader = R"(#version 330 core
in vec4 lineColor;
out vec4 result;
void main() { result = lineColor; }
)";
}  // namespace cullet
