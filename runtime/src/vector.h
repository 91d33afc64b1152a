// SPDX-License-Identifier: MIT
// Three floats, for what the mesher does with triangles.
#pragma once

namespace rill {

struct Vector {
    float x, y, z;
};
inline Vector load(const float* p) { return {p[0], p[1], p[2]}; }
inline Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator*(float k, const Vector& a) { return {k * a.x, k * a.y, k * a.z}; }
inline float dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace rill
