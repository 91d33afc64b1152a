// SPDX-License-Identifier: MIT
// Programs and textures: what draw.cpp needs of OpenGL more than once.
#pragma once
#include <epoxy/gl.h>

#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <string>

namespace player {

/// A linked program and its uniforms by name.
struct Program {
    GLuint name = 0;
    void use() const { glUseProgram(name); }
    GLint at(const char* uniform) const { return glGetUniformLocation(name, uniform); }
    void set(const char* uniform, float x) const { glUniform1f(at(uniform), x); }
    void set(const char* uniform, int x) const { glUniform1i(at(uniform), x); }
    void set(const char* uniform, const glm::vec2& x) const { glUniform2fv(at(uniform), 1, glm::value_ptr(x)); }
    void set(const char* uniform, const glm::vec3& x) const { glUniform3fv(at(uniform), 1, glm::value_ptr(x)); }
    void set(const char* uniform, const glm::vec4& x) const { glUniform4fv(at(uniform), 1, glm::value_ptr(x)); }
    void set(const char* uniform, const glm::mat4& x) const {
        glUniformMatrix4fv(at(uniform), 1, GL_FALSE, glm::value_ptr(x));
    }
};

/// The #version line goes on top of both stages, `world` before the fragment stage's own text. `cause` stays
/// empty when all went well.
Program link(const char* vertex, const char* world, const char* fragment, std::string& cause);

/// Makes or replaces; clamped at its edges.
void make_texture(GLuint& name, GLint format, int width, int height, GLenum layout, GLenum type, const void* data,
                  GLint filter);

}  // namespace player
