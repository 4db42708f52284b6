// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/gl_program.h"

#include <stdexcept>

namespace cullet
{
GlProgram::GlProgram(const std::string& vertexShader, const std::string& fragmentShader)
    : m_program(glCreateProgram())
{
    attach(GL_VERTEX_SHADER, vertexShader);
    attach(GL_FRAGMENT_SHADER, fragmentShader);
    glLinkProgram(m_program);
    GLint isLinked = 0;
    glGetProgramiv(m_program, GL_LINK_STATUS, &isLinked);
    if (isLinked != 0)
        return;
    char log[1024] = "";
    glGetProgramInfoLog(m_program, sizeof log, nullptr, log);
    throw std::runtime_error(std::string("a program of the renderer does not link: ") + log);
}

void GlProgram::attach(GLenum kind, const std::string& source) const
{
    const GLuint shader = glCreateShader(kind);
    const char* const text = source.c_str();
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    GLint isCompiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &isCompiled);
    if (isCompiled == 0)
    {
        char log[1024] = "";
        glGetShaderInfoLog(shader, sizeof log, nullptr, log);
        throw std::runtime_error(std::string("a shader of the renderer does not compile: ") + log);
    }
    glAttachShader(m_program, shader);
    glDeleteShader(shader);
}
}  // namespace cullet
