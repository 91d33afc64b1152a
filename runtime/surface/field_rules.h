// SPDX-License-Identifier: MIT
// The rules of the blend, shared by the kernels and what calls them.
//
// At x the nearest point's normal splits the patches in two clusters: A agrees with it, B opposes it. Each
// cluster is blended on its own; where both have weight the liquid between them is thin (the clusters face
// away from each other: intersection, max) or the air is (they face each other: union, min). Plain blending
// is 5–20 times worse where the thickness is below 1.5 point spacings.
//
// Away from points the winding number of all points gives the sign. Tried on a splash (p99 of the worst frame, % of
// the diagonal): round supports and the nearest plane's sign 10.8; flattened supports 0.28 with stray scraps of 4 %;
// with patches of other faces fading out and the winding number 0.28 without scraps.
#pragma once

namespace rill::surface {

// u² = (|r|² + flatten · (n·r)²) / R²: a patch reaches half as far along its normal as along the surface, or the
// wide patches of a calm far side would speak for fine surface nearby.
constexpr float flatten = 3;
// Where the nearest point is farther (in u²) than `trusted`, the winding number may overrule the blend if it is sure;
// farther than `core` it need not even disagree. It is asked where fewer than `enough_voters` patches of cluster A have a
// say (not if all say air within core: of 12 000 such places none was overruled), and where patches contradict each other:
// the share of their weight that says otherwise, times the variance of what they say (in R² of the nearest), is more than
// `dispute`. Liquid that is none, a fin where the plane of a rim goes on beyond its sheet, is nine of ten of what it finds:
// so where the blend says air and has not taken cluster B, it is asked more seldom. (cooker/README.md, "Spurs", has what
// less and more cost.)
constexpr float core = 0.4f, trusted = 0.03f, enough_voters = 6, dispute = 2e-4f, dispute_air = 4e-3f;
constexpr float sure = 0.2f, likely = 0.35f;  // of the winding number, from 0 or 1: to overrule within and beyond core
// Nor is it asked where the patches in reach alone tell what it would say: of the winding number they are the part that
// turns over at the surface. With as much of it round liquid as `liquid_around`, or as little round air as `air_around`,
// 4 of 115 000 places were overruled: that is half of what else would be asked, and .15 % of what is overruled. (.2 and 0:
// another fifth, and .7 %; in one of ten frames of a splash a spur stays.) Beyond core few are in reach, and less of it tells
// in air: with cells four times as large none was lost there. Liquid is always asked: with .1 cells four times as large lose
// 4 of 974, but at the rims of sheets .57 of the fins stay, not .47.
constexpr float liquid_around = 0.25f, air_around = -0.1f, air_around_far = -0.05f;
// The clusters: bytes at equal p99 on five clips of three splashes, with neighbouring values. (.7, −.2 and R/1.4, so that
// they hardly overlap, take 11 % more.)
constexpr float opposed = -0.4f;        // n·n0 below this: cluster B (−.2 +1.6 %, −.6 +.7 %)
constexpr float agreeing = 0.2f;        // above this: full weight in A; between, patches of another face fade out (.5 +1 %;
                                        // 0 the same, but normals .1° worse)
constexpr float gate_scale = 1 / (agreeing - opposed);
constexpr float opposed_reach = 0.25f;  // cluster B has weight only within R/2 (R/1.7 +.8 %, R/2.4 +.5 %)
constexpr float soften = 0.03f;         // of u² in the weight: how far the blend is from going through each point (1e-4
                                        // +2 %, and normals .2° worse; .1 +2.5 %)
// The gradient is blended by itself: softer (`soften_slopes`), and with `ripple` of the weights' own slope, for that is the
// waves between patches that disagree, of which the liquid has none. Normals then are 5, 5 and 3 % nearer to the source's
// (dam_break, pour_sphere, drop_splash) than with the weights of the value and .65 of their slope, which are 13 % nearer than
// with the exact gradient. Steps to the surface do not mind. (Softer by .2, other powers: cooker/README.md, "How the surface is
// fitted".)
constexpr float soften_slopes = 0.08f, ripple = 0.77f;
// The fit of a patch (field_kernels_fit.h).
constexpr float support_scale = 1.4f;   // R, of the distance to the sixth neighbour
constexpr float fit_reach = 1.15f;      // of its neighbours' weights, of the distance to the last
constexpr float most_bend = 1.8f;       // |curvature|·R at most: a patch never curls over
constexpr float ridge = 1e-3f;          // of the normalised normal equations: minimal norm when degenerate
// Of radius²: bundles of points, and groups of them, farther than this count as one disc. (At 3 a violent splash loses
// 1 % of its p99.)
constexpr float from_afar = 4;

}  // namespace rill::surface
