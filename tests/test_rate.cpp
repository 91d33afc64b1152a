// SPDX-License-Identifier: MIT
// The search for the tolerance that meets a rate, on sizes that are formulas.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "cook/rate_search.h"

using namespace rill::cooker;

namespace {
struct Outcome {
    double tolerance = 0, ratio = 0;
    int attempts = 0;
};
/// `ratio(tolerance)`: bytes over those allowed.
Outcome search(double start, const std::function<double(double)>& ratio) {
    RateSearch search(start, 1e-4, 1);
    Outcome best;
    int attempts = 0;
    while (const auto tolerance = search.next()) {
        REQUIRE(*tolerance > 0.9999e-4);
        REQUIRE(*tolerance < 1.0001);
        REQUIRE(++attempts < 20);
        if (search.add(*tolerance, ratio(*tolerance))) best = {*tolerance, ratio(*tolerance), 0};
    }
    best.attempts = attempts;
    return best;
}
}  // namespace

TEST_CASE("powers with a floor, as sizes are: few attempts, whatever the start") {
    for (double slope : {0.5, 0.8, 1.3})
        for (double floor : {0.0, 0.2, 0.4})
            for (double start : {0.003, 0.02, 0.1}) {
                CAPTURE(slope);
                CAPTURE(floor);
                CAPTURE(start);
                const Outcome found = search(start, [&](double t) { return floor + (1 - floor) * std::pow(t / 0.02, -slope); });
                CHECK(found.ratio == doctest::Approx(1).epsilon(0.0125));
                CHECK(found.attempts <= 6);
            }
}

TEST_CASE("of a size that jumps over the rate, the side below") {
    const Outcome found = search(0.02, [](double t) { return t < 0.031 ? 1.2 : 0.93; });
    CHECK(found.ratio == 0.93);
}

TEST_CASE("beyond the rate at its coarsest, below it at its finest: the nearest, and an end") {
    CHECK(search(0.02, [](double t) { return 3 * std::pow(t, -0.1); }).tolerance == doctest::Approx(1));
    CHECK(search(0.02, [](double t) { return 1e-3 * std::pow(t, -0.1); }).tolerance == doctest::Approx(1e-4));
    CHECK(search(0.02, [](double) { return 0.01; }).attempts <= 3);
}
