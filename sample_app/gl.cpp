// SPDX-License-Identifier: MIT
#include "gl.h"

#include "shaders.h"

namespace player {

static GLuint compile(GLenum stage, const char* world, const char* body, std::string& cause) {
    const char* version = epoxy_is_desktop_gl() ? shader::version_gl : shader::version_es;
    const char* parts[] = {version, world, body};
    const GLuint made = glCreateShader(stage);
    glShaderSource(made, 3, parts, nullptr);
    glCompileShader(made);
    GLint good = 0;
    glGetShaderiv(made, GL_COMPILE_STATUS, &good);
    if (!good) {
        char log[1024];
        glGetShaderInfoLog(made, sizeof log, nullptr, log);
        cause = std::string("a shader does not compile: ") + log;
    }
    return made;
}

Program link(const char* vertex, const char* world, const char* fragment, std::string& cause) {
    Program out{glCreateProgram()};
    const GLuint stages[] = {compile(GL_VERTEX_SHADER, "", vertex, cause),
                             compile(GL_FRAGMENT_SHADER, world, fragment, cause)};
    for (GLuint stage : stages) glAttachShader(out.name, stage);
    glLinkProgram(out.name);
    for (GLuint stage : stages) glDeleteShader(stage);
    GLint good = 0;
    glGetProgramiv(out.name, GL_LINK_STATUS, &good);
    if (!good && cause.empty()) cause = "shaders do not link";
    return out;
}

void make_texture(GLuint& name, GLint format, int width, int height, GLenum layout, GLenum type,
                         const void* data, GLint filter) {
    if (!name) glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, layout, type, data);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

}  // namespace player
