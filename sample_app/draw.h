// SPDX-License-Identifier: MIT
// The only part (with gl.h and offscreen.cpp behind it) that knows a graphics API: what OpenGL 3.3 core and OpenGL ES 3.0 have in common.
#pragma once
#include <memory>
#include <string>

#include "camera.h"
#include "mesh_file.h"
#include "png.h"
#include "rill/rill.h"

namespace player {

enum class Shading { water, clay, normals, velocity };

struct Look {
    Shading shading = Shading::water;
    bool wireframe = false;       ///< triangle edges over the surface
    bool points = false;          ///< the decoded points instead of the surface
    bool show_backfaces = false;  ///< in dark red: holes and flipped triangles stand out
    float full_speed = 1.0f;      ///< metres per second at the end of Shading::velocity's scale
};

/// Which context to ask for; any tries gl first.
enum class Api { any, gl, es };

/// A context without a window, a display or a GPU (EGL surfaceless, Mesa's llvmpipe will do), current on
/// this thread until it is destroyed. Null: `cause` says why in one line.
struct OffscreenContext;
struct EndOffscreen {
    void operator()(OffscreenContext* context) const;
};
std::unique_ptr<OffscreenContext, EndOffscreen> make_offscreen_context(Api api, std::string& cause);

class Renderer {
public:
    /// Needs a current context, as does everything below. Null: `cause` says why.
    static std::unique_ptr<Renderer> create(std::string& cause);
    ~Renderer();

    void set_scene(const Bounds& bounds);            ///< ground, shadows and units follow
    void set_panorama(const Panorama& panorama);

    /// First capacities; 0 = a small default. They grow when frames ask for more.
    void reserve(uint32_t vertices, uint32_t indices, uint32_t points);
    /// A target in mapped GPU memory, for one begin_frame/end_frame; then unmap(), before draw().
    rill::Target* map(const Look& look);
    /// Must be called after end_frame(). False: the memory was lost (mode switch): draw nothing this frame.
    bool unmap();
    /// True when the frame wanted more room than it had, and the next map() will have it.
    bool grow(const rill::Stats& stats);
    /// Instead of map/unmap: a mesh that is not decoded.
    void upload(const Mesh& mesh);

    /// What was last unmapped or uploaded, 4 samples a pixel, into a picture of its own.
    void draw(const Camera& camera, const Look& look, int width, int height);
    Picture read_picture();                          ///< of the last draw()
    void present(int width, int height);             ///< the last draw() into the window
    glm::vec3 to_sun() const;                        ///< unit length
    const std::string& description() const;          ///< API, version and device

private:
    Renderer();
    struct Inside;
    std::unique_ptr<Inside> in_;
};

}  // namespace player
