// SPDX-License-Identifier: MIT
#include "draw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/gtc/matrix_transform.hpp>

#include "gl.h"
#include "shaders.h"

namespace player {

static constexpr int shadow_side = 2048;
static constexpr GLsizei samples = 4;
enum Unit { unit_shadow, unit_panorama, unit_exit_normal, unit_exit_depth };

namespace {

/// What one frame is written into. Three take turns, so that the GPU may still read the last two.
struct Slot {
    GLuint mesh_array = 0, point_array = 0;
    GLuint vertices = 0, indices = 0, lines = 0, points = 0;
    GLsync drawn = nullptr;
    uint32_t vertex_room = 0, index_room = 0, point_room = 0;
    uint32_t index_count = 0, line_index_count = 0, point_count = 0;
};

struct PointVertex {
    glm::vec3 position, normal;
};

}  // namespace

static void make_depth_texture(GLuint& name, int width, int height, GLint filter) {
    make_texture(name, GL_DEPTH_COMPONENT24, width, height, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT, nullptr, filter);
}

static void three_floats(GLuint location, size_t stride, size_t offset) {
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, 3, GL_FLOAT, GL_FALSE, GLsizei(stride), reinterpret_cast<const void*>(offset));
}

struct Renderer::Inside {
    std::string description;
    Program background, surface, exits, flat, point;
    Bounds scene;
    glm::vec3 sun = glm::normalize(glm::vec3(-0.55f, 0.45f, 0.75f));
    glm::mat4 shadow_from_world{1.0f};
    bool has_panorama = false;

    GLuint shadow_depth = 0, shadow_frame = 0, panorama = 0;
    int width = 0, height = 0;
    GLuint colour_samples = 0, depth_samples = 0, sample_frame = 0;  // multisampled
    GLuint colour = 0, colour_frame = 0;                             // resolved
    GLuint exit_normal = 0, exit_depth = 0, exit_frame = 0;          // back faces

    std::array<Slot, 3> slots;
    size_t current = 0;
    uint32_t vertex_room = 1 << 14, index_room = 1 << 16, point_room = 1 << 14, range_room = 256;
    rill::Target target{};
    std::vector<rill::Range> ranges;
    std::vector<uint32_t> indices, edges;  // wireframe only: the one mode that needs them on this side

    bool make_programs(std::string& cause);
    void make_slots();
    void make_shadow();
    void resize(int w, int h);
    void ready(Slot& slot);
    void fill_lines(Slot& slot);
    void set_world(const Program& program, const Camera& camera) const;
    void draw_shadow(const Slot& slot);
    void draw_exits(const Slot& slot, const glm::mat4& clip_from_world);
    void draw_surface(const Slot& slot, const Camera& camera, const Look& look);
};

bool Renderer::Inside::make_programs(std::string& cause) {
    background = link(shader::background_vertex, shader::world, shader::background_fragment, cause);
    surface = link(shader::mesh_vertex, shader::world, shader::surface_fragment, cause);
    exits = link(shader::mesh_vertex, "", shader::exit_fragment, cause);
    flat = link(shader::mesh_vertex, "", shader::flat_fragment, cause);
    point = link(shader::mesh_vertex, "", shader::point_fragment, cause);
    return cause.empty();
}

void Renderer::Inside::make_slots() {
    for (Slot& slot : slots) {
        GLuint buffers[4], arrays[2];
        glGenBuffers(4, buffers);
        glGenVertexArrays(2, arrays);
        slot.vertices = buffers[0], slot.indices = buffers[1], slot.lines = buffers[2], slot.points = buffers[3];
        slot.mesh_array = arrays[0], slot.point_array = arrays[1];
        glBindVertexArray(slot.mesh_array);
        glBindBuffer(GL_ARRAY_BUFFER, slot.vertices);
        three_floats(0, sizeof(Vertex), offsetof(Vertex, position));
        three_floats(1, sizeof(Vertex), offsetof(Vertex, normal));
        three_floats(2, sizeof(Vertex), offsetof(Vertex, velocity));
        glBindVertexArray(slot.point_array);
        glBindBuffer(GL_ARRAY_BUFFER, slot.points);
        three_floats(0, sizeof(PointVertex), offsetof(PointVertex, position));
        three_floats(1, sizeof(PointVertex), offsetof(PointVertex, normal));
    }
    glBindVertexArray(0);
}

void Renderer::Inside::make_shadow() {
    make_depth_texture(shadow_depth, shadow_side, shadow_side, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glGenFramebuffers(1, &shadow_frame);
    glBindFramebuffer(GL_FRAMEBUFFER, shadow_frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadow_depth, 0);
    const GLenum none = GL_NONE;
    glDrawBuffers(1, &none);
    glReadBuffer(GL_NONE);
}

void Renderer::Inside::resize(int w, int h) {
    if (w == width && h == height) return;
    width = w, height = h;
    make_texture(colour, GL_RGBA8, w, h, GL_RGBA, GL_UNSIGNED_BYTE, nullptr, GL_NEAREST);
    make_texture(exit_normal, GL_RGBA8, w, h, GL_RGBA, GL_UNSIGNED_BYTE, nullptr, GL_LINEAR);
    make_depth_texture(exit_depth, w, h, GL_NEAREST);
    if (!sample_frame) {
        GLuint frames[3], buffers[2];
        glGenFramebuffers(3, frames);
        glGenRenderbuffers(2, buffers);
        sample_frame = frames[0], colour_frame = frames[1], exit_frame = frames[2];
        colour_samples = buffers[0], depth_samples = buffers[1];
    }
    glBindRenderbuffer(GL_RENDERBUFFER, colour_samples);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA8, w, h);
    glBindRenderbuffer(GL_RENDERBUFFER, depth_samples);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT24, w, h);
    glBindFramebuffer(GL_FRAMEBUFFER, sample_frame);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_samples);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_samples);
    glBindFramebuffer(GL_FRAMEBUFFER, colour_frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, exit_frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, exit_normal, 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, exit_depth, 0);
}

// ---- life

Renderer::Renderer() : in_(new Inside) {}

std::unique_ptr<Renderer> Renderer::create(std::string& cause) {
    // Both names exist in both APIs, but only desktop OpenGL needs to be told that shaders size points.
    const bool gl = epoxy_is_desktop_gl();
    if (epoxy_gl_version() < (gl ? 33 : 30)) {
        cause = "needs OpenGL 3.3 or OpenGL ES 3.0";
        return nullptr;
    }
    std::unique_ptr<Renderer> out(new Renderer);
    Inside& in = *out->in_;
    in.description = std::string(reinterpret_cast<const char*>(glGetString(GL_VERSION))) + ", " +
                     reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    if (gl) glEnable(GL_PROGRAM_POINT_SIZE);
    if (!in.make_programs(cause)) return nullptr;
    in.make_slots();
    in.make_shadow();
    const float white[] = {1, 1, 1};
    make_texture(in.panorama, GL_RGB16F, 1, 1, GL_RGB, GL_FLOAT, white, GL_LINEAR);
    return out;
}

/// GL objects go with the context, which its owner destroys right after.
Renderer::~Renderer() = default;

const std::string& Renderer::description() const { return in_->description; }
glm::vec3 Renderer::to_sun() const { return in_->sun; }

void Renderer::set_scene(const Bounds& bounds) {
    in_->scene = bounds;
    const float radius = 0.75f * bounds.diagonal();  // a little more than the bounds: their shadow as well
    const glm::mat4 view = glm::lookAt(bounds.centre() + in_->sun * radius, bounds.centre(), {0, 0, 1});
    in_->shadow_from_world = glm::ortho(-radius, radius, -radius, radius, 0.0f, 2.0f * radius) * view;
}

void Renderer::set_panorama(const Panorama& panorama) {
    in_->has_panorama = !panorama.rgb.empty();
    if (in_->has_panorama)
        make_texture(in_->panorama, GL_RGB16F, panorama.width, panorama.height, GL_RGB, GL_FLOAT, panorama.rgb.data(),
                     GL_LINEAR);
}

// ---- streaming

void Renderer::reserve(uint32_t vertices, uint32_t indices, uint32_t points) {
    in_->vertex_room = std::max(in_->vertex_room, vertices);
    in_->index_room = std::max(in_->index_room, indices);
    in_->point_room = std::max(in_->point_room, points);
}

bool Renderer::grow(const rill::Stats& stats) {
    bool grown = false;
    const auto want = [&](uint32_t bit, uint32_t& room, uint32_t wanted) {
        if (!(stats.cut & bit) || wanted <= room) return;
        room = wanted + wanted / 4;
        grown = true;
    };
    want(rill::cut_vertices, in_->vertex_room, stats.vertices_wanted);
    want(rill::cut_indices, in_->index_room, stats.indices_wanted);
    want(rill::cut_points, in_->point_room, stats.points_wanted);
    want(rill::cut_ranges, in_->range_room, stats.ranges_wanted);
    return grown;
}

/// Brings the next slot up to size; waits for the GPU only when it is three frames behind.
void Renderer::Inside::ready(Slot& slot) {
    if (slot.drawn) {
        glClientWaitSync(slot.drawn, GL_SYNC_FLUSH_COMMANDS_BIT, 1000000000);
        glDeleteSync(slot.drawn);
        slot.drawn = nullptr;
    }
    glBindVertexArray(slot.mesh_array);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, slot.indices);
    const auto room = [](GLenum kind, GLuint name, uint32_t& has, uint32_t wants, size_t element) {
        glBindBuffer(kind, name);
        if (has >= wants) return;
        glBufferData(kind, GLsizeiptr(wants * element), nullptr, GL_STREAM_DRAW);
        has = wants;
    };
    room(GL_ARRAY_BUFFER, slot.points, slot.point_room, point_room, sizeof(PointVertex));
    room(GL_ARRAY_BUFFER, slot.vertices, slot.vertex_room, vertex_room, sizeof(Vertex));
    room(GL_ELEMENT_ARRAY_BUFFER, slot.indices, slot.index_room, index_room, sizeof(uint32_t));
}

static char* map_buffer(GLenum kind, GLuint name, size_t bytes) {
    glBindBuffer(kind, name);
    return static_cast<char*>(glMapBufferRange(kind, 0, GLsizeiptr(bytes),
        GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT | GL_MAP_UNSYNCHRONIZED_BIT));
}

rill::Target* Renderer::map(const Look& look) {
    Inside& in = *in_;
    in.current = (in.current + 1) % in.slots.size();
    Slot& slot = in.slots[in.current];
    in.ready(slot);
    in.ranges.resize(in.range_room);
    in.target = {};
    rill::Target& target = in.target;
    if (char* to = map_buffer(GL_ARRAY_BUFFER, slot.vertices, slot.vertex_room * sizeof(Vertex))) {
        target.position = {to + offsetof(Vertex, position), sizeof(Vertex)};
        target.normal = {to + offsetof(Vertex, normal), sizeof(Vertex)};
        target.velocity = {to + offsetof(Vertex, velocity), sizeof(Vertex)};
        target.vertex_capacity = slot.vertex_room;
    }
    in.indices.resize(look.wireframe ? slot.index_room : 0);
    target.indices = look.wireframe ? in.indices.data()
                                    : reinterpret_cast<uint32_t*>(map_buffer(
                                          GL_ELEMENT_ARRAY_BUFFER, slot.indices, slot.index_room * sizeof(uint32_t)));
    target.index_capacity = target.indices ? slot.index_room : 0;
    if (look.points) {
        if (char* to = map_buffer(GL_ARRAY_BUFFER, slot.points, slot.point_room * sizeof(PointVertex))) {
            target.point_position = {to + offsetof(PointVertex, position), sizeof(PointVertex)};
            target.point_normal = {to + offsetof(PointVertex, normal), sizeof(PointVertex)};
            target.point_capacity = slot.point_room;
        }
    }
    target.ranges = in.ranges.data();
    target.range_capacity = in.range_room;
    return &target;
}

bool Renderer::unmap() {
    Inside& in = *in_;
    Slot& slot = in.slots[in.current];
    glBindVertexArray(slot.mesh_array);
    bool kept = true;
    const auto close = [&](GLenum kind, GLuint name, const void* mapped) {
        glBindBuffer(kind, name);
        if (mapped) kept &= glUnmapBuffer(kind) == GL_TRUE;
    };
    close(GL_ARRAY_BUFFER, slot.vertices, in.target.position.data);
    close(GL_ARRAY_BUFFER, slot.points, in.target.point_position.data);
    const bool lines = !in.indices.empty();
    close(GL_ELEMENT_ARRAY_BUFFER, slot.indices, lines ? nullptr : in.target.indices);
    slot.index_count = kept ? in.target.indices_used : 0;
    slot.point_count = kept ? in.target.points_used : 0;
    slot.line_index_count = 0;
    if (lines) {
        glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, 0, GLsizeiptr(slot.index_count * sizeof(uint32_t)), in.indices.data());
        in.fill_lines(slot);
    }
    return kept;
}

/// Every edge of every triangle: polygon modes are not common ground. An edge that two triangles share
/// comes twice, which costs a little and loses no border.
void Renderer::Inside::fill_lines(Slot& slot) {
    edges.clear();
    for (uint32_t i = 0; i < slot.index_count; ++i) {
        edges.push_back(indices[i]);
        edges.push_back(indices[i % 3 == 2 ? i - 2 : i + 1]);
    }
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, slot.lines);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(edges.size() * sizeof(uint32_t)), edges.data(), GL_STREAM_DRAW);
    slot.line_index_count = uint32_t(edges.size());
}

void Renderer::upload(const Mesh& mesh) {
    Inside& in = *in_;
    in.current = (in.current + 1) % in.slots.size();
    Slot& slot = in.slots[in.current];
    reserve(uint32_t(mesh.vertices.size()), uint32_t(mesh.indices.size()), 0);
    in.ready(slot);
    glBufferSubData(GL_ARRAY_BUFFER, 0, GLsizeiptr(mesh.vertices.size() * sizeof(Vertex)), mesh.vertices.data());
    glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, 0, GLsizeiptr(mesh.indices.size() * sizeof(uint32_t)), mesh.indices.data());
    slot.index_count = uint32_t(mesh.indices.size());
    slot.point_count = 0;
    in.indices = mesh.indices;
    in.fill_lines(slot);
}

// ---- drawing

void Renderer::Inside::set_world(const Program& program, const Camera& camera) const {
    program.use();
    // A round number of metres near an eighth of the scene: 1, 2 or 5 times a power of ten.
    const float wish = scene.diagonal() / 8.0f;
    const float ten = std::pow(10.0f, std::floor(std::log10(wish)));
    program.set("tile", wish < 2 * ten ? ten : wish < 5 * ten ? 2 * ten : 5 * ten);
    program.set("unit", scene.diagonal());
    program.set("ground", scene.lower.z - 0.01f * scene.diagonal());
    program.set("eye", camera.eye());
    program.set("sun", sun);
    program.set("shadow_from_world", shadow_from_world);
    program.set("has_panorama", int(has_panorama));
    program.set("shadow_map", int(unit_shadow));
    program.set("panorama", int(unit_panorama));
}

static void draw_triangles(const Slot& slot) {
    glBindVertexArray(slot.mesh_array);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, slot.indices);
    glDrawElements(GL_TRIANGLES, GLsizei(slot.index_count), GL_UNSIGNED_INT, nullptr);
}

void Renderer::Inside::draw_shadow(const Slot& slot) {
    glBindFramebuffer(GL_FRAMEBUFFER, shadow_frame);
    glViewport(0, 0, shadow_side, shadow_side);
    glClear(GL_DEPTH_BUFFER_BIT);
    exits.use();
    exits.set("clip_from_world", shadow_from_world);
    draw_triangles(slot);
}

void Renderer::Inside::draw_exits(const Slot& slot, const glm::mat4& clip_from_world) {
    glBindFramebuffer(GL_FRAMEBUFFER, exit_frame);
    glViewport(0, 0, width, height);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glCullFace(GL_FRONT);
    exits.use();
    exits.set("clip_from_world", clip_from_world);
    draw_triangles(slot);
    glCullFace(GL_BACK);
}

void Renderer::Inside::draw_surface(const Slot& slot, const Camera& camera, const Look& look) {
    const glm::mat4 projection = camera.projection(float(width) / float(height), scene);
    const glm::mat4 clip_from_world = projection * camera.view();
    set_world(surface, camera);
    surface.set("clip_from_world", clip_from_world);
    surface.set("forward", glm::normalize(camera.target - camera.eye()));
    surface.set("depth_terms", glm::vec2(projection[2][2], projection[3][2]));
    surface.set("full_speed", look.full_speed);
    surface.set("shading", int(look.shading));
    surface.set("exit_normal", int(unit_exit_normal));
    surface.set("exit_depth", int(unit_exit_depth));
    glPolygonOffset(1.0f, 1.0f);  // lines lie on top
    if (look.wireframe) glEnable(GL_POLYGON_OFFSET_FILL);
    draw_triangles(slot);
    flat.use();
    flat.set("clip_from_world", clip_from_world);
    if (look.show_backfaces) {
        flat.set("flat_colour", glm::vec4(0.35f, 0.02f, 0.03f, 1.0f));
        glCullFace(GL_FRONT);
        draw_triangles(slot);
        glCullFace(GL_BACK);
    }
    glDisable(GL_POLYGON_OFFSET_FILL);
    if (look.wireframe) {
        flat.set("flat_colour", glm::vec4(0.10f, 0.22f, 0.34f, 1.0f));
        glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, slot.lines);
        glDrawElements(GL_LINES, GLsizei(slot.line_index_count), GL_UNSIGNED_INT, nullptr);
    }
}

void Renderer::draw(const Camera& camera, const Look& look, int width, int height) {
    Inside& in = *in_;
    Slot& slot = in.slots[in.current];
    in.resize(width, height);
    const glm::mat4 clip_from_world = camera.projection(float(width) / float(height), in.scene) * camera.view();
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
    in.draw_shadow(slot);
    in.draw_exits(slot, clip_from_world);

    const GLuint textures[] = {in.shadow_depth, in.panorama, in.exit_normal, in.exit_depth};
    for (GLuint unit = 0; unit < 4; ++unit) {
        glActiveTexture(GL_TEXTURE0 + unit);
        glBindTexture(GL_TEXTURE_2D, textures[unit]);
    }
    glActiveTexture(GL_TEXTURE0);
    glBindFramebuffer(GL_FRAMEBUFFER, in.sample_frame);
    glViewport(0, 0, width, height);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDisable(GL_DEPTH_TEST);
    in.set_world(in.background, camera);
    in.background.set("world_from_clip", glm::inverse(clip_from_world));
    glBindVertexArray(slot.mesh_array);  // core profiles want one; nothing of it is read
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glEnable(GL_DEPTH_TEST);
    if (look.points) {
        in.point.use();
        in.point.set("clip_from_world", clip_from_world);
        in.point.set("sun", in.sun);
        glBindVertexArray(slot.point_array);
        glDrawArrays(GL_POINTS, 0, GLsizei(slot.point_count));
    } else {
        in.draw_surface(slot, camera, look);
    }
    if (slot.drawn) glDeleteSync(slot.drawn);
    slot.drawn = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, in.sample_frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, in.colour_frame);
    glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

Picture Renderer::read_picture() {
    const int width = in_->width, height = in_->height;
    std::vector<uint8_t> rgba(size_t(width) * height * 4);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, in_->colour_frame);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    Picture out(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            std::copy_n(&rgba[(size_t(height - 1 - y) * width + x) * 4], 3, &out.rgb[(size_t(y) * width + x) * 3]);
    return out;
}

void Renderer::present(int width, int height) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, in_->colour_frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glBlitFramebuffer(0, 0, in_->width, in_->height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

}  // namespace player
