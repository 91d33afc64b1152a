// SPDX-License-Identifier: MIT
// The search for the tolerance that meets an error, on errors and sizes that are formulas.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "cook/error_search.h"

using namespace rill::cooker;

namespace {
struct Outcome {
    double tolerance = 0, ratio = 0;
    int attempts = 0;
};
using OfTolerance = std::function<double(double)>;
/// `ratio(tolerance)`: the error over the one aimed at.
Outcome search(double edges, const OfTolerance& ratio, const OfTolerance& bytes = [](double t) { return 1e5 / t; },
               double triangles = 60000) {
    ErrorSearch search(edges, 0.2, triangles);
    Outcome best;
    while (const auto tolerance = search.next()) {
        REQUIRE(*tolerance > 0);
        REQUIRE(search.attempts() < 10);
        if (search.add(*tolerance, ratio(*tolerance), bytes(*tolerance))) best = {*tolerance, ratio(*tolerance), 0};
    }
    best.attempts = search.attempts();
    return best;
}
double first(double edges) { return search(edges, [](double) { return 1; }).tolerance; }
}  // namespace

TEST_CASE("an error that is a power of the tolerance is met, from either side") {
    for (double edges : {0.12, 0.25, 0.5})
        for (double power : {0.5, 0.8, 1.1})
            for (double begins_at : {0.6, 0.85, 1.2, 1.4}) {
                CAPTURE(edges);
                CAPTURE(power);
                CAPTURE(begins_at);
                const double start = first(edges);
                const Outcome found = search(edges, [&](double t) { return begins_at * std::pow(t / start, power); });
                CHECK(found.ratio <= 1.1);
                CHECK(found.ratio >= 0.9);
                CHECK(found.attempts <= 3);
            }
}

TEST_CASE("what is near, or has no surface to be off, takes one attempt") {
    for (double ratio : {0.91, 1.0, 1.09}) CHECK(search(0.25, [&](double) { return ratio; }).attempts == 1);
}

TEST_CASE("an error that points do not tell ends the search, and the bytes that it would have cost are saved") {
    const double start = first(0.25);
    const Outcome stuck = search(0.25, [&](double t) { return 1.6 * std::pow(t / start, 0.1); });
    CHECK(stuck.attempts == 2);
    CHECK(stuck.tolerance == doctest::Approx(start));
    const Outcome cheap = search(0.25, [&](double t) { return 1.6 * std::pow(t / start, 0.1); }, [](double) { return 1e5; });
    CHECK(cheap.tolerance < start);
}

TEST_CASE("a small step that did not help is no reason to give up") {
    const double start = first(0.25);
    const Outcome found = search(0.25, [&](double t) { return t > 0.95 * start ? 1.2 : t > 0.8 * start ? 1.21 : 1.0; });
    CHECK(found.ratio == 1.0);
}

TEST_CASE("one that falls too slowly to be met is still brought nearer for its bytes") {
    const double start = first(0.25);
    const Outcome found = search(0.25, [&](double t) { return 3 * std::pow(t / start, 0.5); });
    CHECK(found.tolerance < start);
    CHECK(found.ratio < 2.5);
}

TEST_CASE("where the error goes in leaps, as of a few points, attempts go on until one meets it") {
    const double start = first(0.25);
    const OfTolerance leap = [&](double t) { return t > 0.4 * start ? 1.2 : 0.95; };
    CHECK(search(0.25, leap).ratio == 1.2);
    CHECK(search(0.25, leap, [](double t) { return 1e5 / t; }, 500).ratio == 0.95);
}

TEST_CASE("missing the target by little is no better than being too fine") {
    const double start = first(0.25);
    const Outcome found = search(0.25, [&](double t) { return t < 0.95 * start ? 0.7 : 1.12; });
    CHECK(found.ratio == 0.7);
}
