// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

// The functions of OpenGL 3.3, which OSMesa exports by name.
#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>
//
#include <Eigen/Core>

#include <GL/glext.h>
#include <string>

namespace cullet
{
/// A linked program, which is freed with the current context.
class GlProgram
{
public:
    /// @throws std::runtime_error with the compiler's log
    GlProgram(const std::string& vertexShader, const std::string& fragmentShader);

    void use() const { glUseProgram(m_program); }
    void set(const char* name, float value) const { glUniform1f(find(name), value); }
    void set(const char* name, int value) const { glUniform1i(find(name), value); }
    void set(const char* name, const Eigen::Vector3f& value) const
    {
        glUniform3fv(find(name), 1, value.data());
    }
    void set(const char* name, const Eigen::Matrix4f& value) const
    {
        glUniformMatrix4fv(find(name), 1, GL_FALSE, value.data());
    }

private:
    GLint find(const char* name) const { return glGetUniformLocation(m_program, name); }
    void attach(GLenum kind, const std::string& source) const;

    GLuint m_program;
};
}  // namespace cullet
