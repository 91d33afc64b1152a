// SPDX-License-Identifier: MIT
// Three floats in a register of four, for what the mesher does with triangles; nothing reads the fourth.
#pragma once
#include <cstring>

namespace rill {

#if defined(__GNUC__)
using Lanes = float __attribute__((vector_size(16)));
#else
struct Lanes {
    float lane[4];
    float operator[](int i) const { return lane[i]; }
};
inline Lanes operator+(const Lanes& a, const Lanes& b) { return {{a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]}}; }
inline Lanes operator-(const Lanes& a, const Lanes& b) { return {{a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]}}; }
inline Lanes operator*(const Lanes& a, const Lanes& b) { return {{a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]}}; }
inline Lanes operator*(float k, const Lanes& a) { return {{k * a[0], k * a[1], k * a[2], k * a[3]}}; }
#endif

struct Vector {
    Lanes at;
};
inline Vector load(const float (&p)[4]) {
    Vector v;
    std::memcpy(&v.at, p, sizeof(v.at));
    return v;
}
inline Vector operator-(const Vector& a, const Vector& b) { return {a.at - b.at}; }
inline Vector operator+(const Vector& a, const Vector& b) { return {a.at + b.at}; }
inline Vector operator*(float k, const Vector& a) { return {k * a.at}; }
inline float dot(const Vector& a, const Vector& b) {
    const Lanes of = a.at * b.at;
    return of[0] + of[1] + of[2];
}
/// y z x.
inline Lanes turned(const Lanes& a) { return Lanes{a[1], a[2], a[0], a[3]}; }
inline Vector cross(const Vector& a, const Vector& b) { return {turned(a.at * turned(b.at) - turned(a.at) * b.at)}; }

}  // namespace rill
