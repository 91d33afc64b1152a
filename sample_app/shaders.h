// SPDX-License-Identifier: MIT
// GLSL in the words that 3.30 core and 3.00 es share; draw.cpp puts the #version line on top.
//
// There is nothing in the world but liquid, a checkered ground and a sky, and the last two are functions:
// what a ray sees once it has left the liquid is computed, whether it comes from the eye, a reflection
// or a refraction. Refraction goes through two interfaces, after Wyman 2005, "An Approximate Image-Space
// Approach for Interactive Refraction": the back faces' normals and depths are drawn first.
#pragma once

namespace player::shader {

inline constexpr char version_gl[] = "#version 330 core\n";
inline constexpr char version_es[] =
    "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
    "precision highp sampler2DShadow;\n";

/// Everything that is not liquid: scene(), and tone() from light to display.
inline constexpr char world[] = R"(
uniform vec3 eye, sun;
uniform float unit, ground, tile;      // diagonal of the bounds; height; side of a square: metres
uniform mat4 shadow_from_world;
uniform sampler2DShadow shadow_map;
uniform sampler2D panorama;
uniform bool has_panorama;

vec3 sky(vec3 d) {
    if (has_panorama) {
        vec2 at = vec2(atan(d.y, d.x) / 6.2831853 + 0.5, acos(clamp(d.z, -1.0, 1.0)) / 3.1415927);
        return min(texture(panorama, at).rgb, vec3(30.0));
    }
    float up = clamp(d.z, 0.0, 1.0);
    vec3 c = mix(vec3(0.78, 0.86, 0.93), vec3(0.13, 0.31, 0.62), pow(up, 0.55));
    // A photographer's soft boxes: broad edges that show on a smooth surface and break on a rough one.
    vec2 p = d.xy / max(d.z, 0.02);
    vec2 a = smoothstep(vec2(0.62, 0.42), vec2(0.5, 0.3), abs(p - vec2(0.55, -0.35)));
    vec2 b = smoothstep(vec2(0.3, 1.3), vec2(0.2, 1.1), abs(p - vec2(-1.5, 0.6)));
    c += step(0.02, d.z) * (2.2 * a.x * a.y + 1.1 * b.x * b.y);
    float s = max(dot(d, sun), 0.0);
    return c + vec3(1.0, 0.9, 0.75) * (40.0 * pow(s, 2500.0) + 0.9 * pow(s, 60.0) + 0.2 * pow(s, 6.0));
}

/// 1 in the sun, 0 behind liquid.
float sunlight(vec3 p) {
    vec4 q = shadow_from_world * vec4(p, 1.0);
    vec3 s = q.xyz * 0.5 + 0.5;
    if (any(lessThan(s, vec3(0.0))) || any(greaterThan(s, vec3(1.0)))) return 1.0;
    float lit = 0.0;  // each tap is the mean of four texels
    for (int i = 0; i < 4; ++i) {
        vec2 around = vec2(float(i % 2) - 0.5, float(i / 2) - 0.5) / 500.0;
        lit += texture(shadow_map, vec3(s.xy + around, s.z - 0.002));
    }
    return lit / 4.0;
}

/// Squares, filtered over a footprint w (Quilez, "Filtering the checkerboard pattern").
float squares(vec2 p, vec2 w) {
    vec2 i = 2.0 * (abs(fract((p - 0.5 * w) * 0.5) - 0.5) - abs(fract((p + 0.5 * w) * 0.5) - 0.5)) / w;
    return 0.5 - 0.5 * i.x * i.y;
}

vec3 scene(vec3 from, vec3 d) {
    float t = (ground - from.z) / min(d.z, -1e-4);
    vec3 hit = from + t * d;
    vec2 w = clamp(fwidth(hit.xy / tile), 0.001, 8.0);
    vec3 above = sky(d);
    if (d.z > -1e-4 || t < 0.0) return above;
    vec3 albedo = mix(vec3(0.25, 0.26, 0.28), vec3(0.40, 0.40, 0.39), squares(hit.xy / tile, w));
    // Liquid lets light through: its shadow is neither black nor grey.
    vec3 shade = mix(vec3(0.22, 0.36, 0.42), vec3(1.0), sunlight(hit));
    vec3 light = vec3(1.25, 1.15, 1.0) * sun.z * shade + vec3(0.34, 0.38, 0.44) * mix(vec3(0.75), vec3(1.0), shade);
    vec3 haze = sky(normalize(vec3(d.xy, 0.02)));
    float far = length(hit - eye) / unit;
    return mix(haze, albedo * light, exp(-0.03 * far * far));
}

/// Narkowicz's fit of the ACES curve, then the display's gamma.
vec3 tone(vec3 c) {
    c *= 0.75;
    c = clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
    return pow(c, vec3(1.0 / 2.2));
}
)";

inline constexpr char background_vertex[] = R"(
uniform mat4 world_from_clip;
out vec3 far_point;
void main() {
    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    vec4 p = world_from_clip * vec4(at, 1.0, 1.0);
    far_point = p.xyz / p.w;
    gl_Position = vec4(at, 1.0, 1.0);
}
)";
inline constexpr char background_fragment[] = R"(
in vec3 far_point;
out vec4 colour;
void main() { colour = vec4(tone(scene(eye, normalize(far_point - eye))), 1.0); }
)";

inline constexpr char mesh_vertex[] = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 velocity;
uniform mat4 clip_from_world;
out vec3 world_position, world_normal, world_velocity;
void main() {
    world_position = position;
    world_normal = normal;
    world_velocity = velocity;
    gl_Position = clip_from_world * vec4(position, 1.0);
    gl_PointSize = 3.0;
}
)";

/// Back faces for refraction: normal in rgb, presence in alpha. Also the shadow pass, without colour.
inline constexpr char exit_fragment[] = R"(
in vec3 world_normal;
out vec4 colour;
void main() { colour = vec4(normalize(world_normal) * 0.5 + 0.5, 1.0); }
)";

inline constexpr char flat_fragment[] = R"(
uniform vec4 flat_colour;
out vec4 colour;
void main() { colour = flat_colour; }
)";

inline constexpr char surface_fragment[] = R"(
in vec3 world_position, world_normal, world_velocity;
uniform mat4 clip_from_world;
uniform vec3 forward;
uniform vec2 depth_terms;              // of the projection: distance = y / (2 depth − 1 + x)
uniform float full_speed;              // metres per second at the end of the colour scale
uniform int shading;                   // 0 water, 1 clay, 2 normals, 3 velocity
uniform sampler2D exit_normal, exit_depth;
out vec4 colour;

/// Distance along the ray from the eye at which it leaves the liquid; negative: it does not.
float exit_distance(vec2 at, vec3 ray) {
    float depth = texture(exit_depth, at).r;
    return depth >= 1.0 ? -1.0 : depth_terms.y / (2.0 * depth - 1.0 + depth_terms.x) / dot(ray, forward);
}

vec3 water(vec3 p, vec3 n) {
    vec3 ray = normalize(p - eye);
    float facing = clamp(-dot(ray, n), 0.0, 1.0);
    float fresnel = 0.02 + 0.98 * pow(1.0 - facing, 5.0);
    vec3 mirrored = reflect(ray, n);

    vec4 clip = clip_from_world * vec4(p, 1.0);
    float through = exit_distance(clip.xy / clip.w * 0.5 + 0.5, ray) - length(p - eye);
    through = clamp(through, 0.002 * unit, unit);
    vec3 inside = refract(ray, n, 1.0 / 1.33);
    if (inside.z < 0.0) through = min(through, max(p.z - ground, 0.0) / -inside.z);
    vec3 leaves = p + inside * through * 0.999;
    clip = clip_from_world * vec4(leaves, 1.0);
    vec4 there = texture(exit_normal, clamp(clip.xy / clip.w * 0.5 + 0.5, 0.001, 0.999));
    vec3 outside = inside;
    // Liquid that lies on the ground wets it: nothing bends there.
    if (there.a > 0.5 && leaves.z > ground + 0.03 * unit) {
        vec3 m = normalize(there.rgb * 2.0 - 1.0);
        outside = refract(inside, -m, 1.33);
        if (dot(outside, outside) < 0.5) {
            outside = reflect(inside, -m);
            through *= 1.7;  // totally reflected: the way out is about as long again
        }
    }
    // Beer and Lambert in units of the scene, so that a glass and a harbour look alike.
    float depth = through / unit;
    vec3 behind = scene(leaves, normalize(outside)) * exp(-vec3(6.0, 1.7, 1.15) * depth);
    vec3 glow = vec3(0.015, 0.13, 0.18) * (0.6 + 0.4 * clamp(dot(n, sun), 0.0, 1.0));
    vec3 body = behind + glow * (1.0 - exp(-3.5 * depth));
    return mix(body, scene(p, mirrored), fresnel);
}

vec3 clay(vec3 p, vec3 n) {
    vec3 to_eye = normalize(eye - p);
    float lit = max(dot(n, sun), 0.0) * sunlight(p + 0.004 * unit * n);
    vec3 ambient = mix(vec3(0.20, 0.18, 0.17), vec3(0.46, 0.50, 0.56), 0.5 + 0.5 * n.z);
    float rim = pow(1.0 - clamp(dot(n, to_eye), 0.0, 1.0), 3.0);
    float shine = pow(max(dot(n, normalize(sun + to_eye)), 0.0), 60.0);
    return vec3(0.55) * (ambient + vec3(1.15, 1.08, 0.98) * lit) + 0.18 * rim + 0.12 * shine;
}

vec3 heat(float x) {  // blue, cyan, green, yellow, red
    return clamp(1.5 - abs(4.0 * clamp(x, 0.0, 1.0) - vec3(3.0, 2.0, 1.0)), 0.0, 1.0);
}

void main() {
    vec3 n = normalize(world_normal);
    float light = 0.45 + 0.55 * clamp(0.5 + 0.5 * dot(n, sun), 0.0, 1.0);
    if (shading == 0) colour = vec4(tone(water(world_position, n)), 1.0);
    else if (shading == 1) colour = vec4(tone(clay(world_position, n)), 1.0);
    else if (shading == 2) colour = vec4(n * 0.5 + 0.5, 1.0);
    else colour = vec4(light * heat(length(world_velocity) / full_speed), 1.0);
}
)";

inline constexpr char point_fragment[] = R"(
in vec3 world_normal;
uniform vec3 sun;
out vec4 colour;
void main() {
    vec2 at = gl_PointCoord - 0.5;
    if (dot(at, at) > 0.25) discard;
    colour = vec4(vec3(0.25, 0.6, 0.95) * (0.4 + 0.6 * (0.5 + 0.5 * dot(normalize(world_normal), sun))), 1.0);
}
)";

}  // namespace player::shader
