// SPDX-License-Identifier: MIT
// Contexts without windows, by EGL.
#include <epoxy/egl.h>

#include "draw.h"

namespace player {

struct OffscreenContext {
    EGLDisplay display;
    EGLContext context;
    EGLSurface surface;
};

/// Mesa's display of nothing first; else whatever the system calls its default.
static EGLDisplay open_display() {
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
        EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
        if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr)) return display;
    }
    EGLDisplay display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr)) return display;
    return EGL_NO_DISPLAY;
}

static bool make_current(OffscreenContext& out, bool es) {
    const EGLint config_wishes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                    es ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT, EGL_NONE};
    const EGLint gl_wishes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3,
                                EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    const EGLint es_wishes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
    const EGLint size[] = {EGL_WIDTH, 16, EGL_HEIGHT, 16, EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    if (!eglBindAPI(es ? EGL_OPENGL_ES_API : EGL_OPENGL_API)) return false;
    if (!eglChooseConfig(out.display, config_wishes, &config, 1, &count) || count == 0) return false;
    out.context = eglCreateContext(out.display, config, EGL_NO_CONTEXT, es ? es_wishes : gl_wishes);
    if (out.context == EGL_NO_CONTEXT) return false;
    // Everything is drawn into framebuffer objects; a surface is only there for drivers that insist.
    out.surface = eglCreatePbufferSurface(out.display, config, size);
    if (eglMakeCurrent(out.display, out.surface, out.surface, out.context)) return true;
    if (out.surface != EGL_NO_SURFACE) eglDestroySurface(out.display, out.surface);
    eglDestroyContext(out.display, out.context);
    out.context = EGL_NO_CONTEXT;
    return false;
}

std::unique_ptr<OffscreenContext, EndOffscreen> make_offscreen_context(Api api, std::string& cause) {
    OffscreenContext made{open_display(), EGL_NO_CONTEXT, EGL_NO_SURFACE};
    if (made.display == EGL_NO_DISPLAY) {
        cause = "EGL finds no display, not even a surfaceless one (Debian: libegl1 and libgl1-mesa-dri)";
        return nullptr;
    }
    if ((api != Api::es && make_current(made, false)) || (api != Api::gl && make_current(made, true)))
        return std::unique_ptr<OffscreenContext, EndOffscreen>(new OffscreenContext(made));
    cause = "EGL offers neither OpenGL 3.3 core nor OpenGL ES 3.0 as asked for";
    return nullptr;
}

void EndOffscreen::operator()(OffscreenContext* context) const {
    eglMakeCurrent(context->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context->surface != EGL_NO_SURFACE) eglDestroySurface(context->display, context->surface);
    eglDestroyContext(context->display, context->context);
    // The display stays initialised: terminating it unloads the driver, and leak checkers could no longer tell
    // whose the memory was that drivers keep until the process ends.
    delete context;
}

}  // namespace player
