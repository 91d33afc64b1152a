// SPDX-License-Identifier: MIT
// The time basis: orthonormal on the samples, as good as a Fourier extension should be, and a spline between them.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "basis_tables.h"
#include "format/carried_motion.h"

using namespace rill::format;

namespace {

constexpr double pi = 3.14159265358979323846;

struct Row {
    float value[max_terms], derivative[max_terms];
};
Row row(uint32_t samples, bool cosine, double s, uint32_t terms) {
    Row r{};
    spline_row(tables(), samples, cosine, s, {}, terms, r.value, r.derivative);
    return r;
}

/// Least squares in the first `terms` functions; the signal is a function of x in [−1, 1].
struct Fit {
    uint32_t samples, terms;
    bool cosine;
    std::vector<double> c;
    Fit(uint32_t samples, uint32_t terms, bool cosine, const std::function<double(double)>& f)
        : samples(samples), terms(terms), cosine(cosine), c(terms) {
        for (uint32_t s = 0; s < samples; ++s) {
            const Row r = row(samples, cosine, s, terms);
            for (uint32_t k = 0; k < terms; ++k) c[k] += f(x_at(s)) * r.value[k];
        }
    }
    double x_at(double s) const { return samples > 1 ? 2 * s / (samples - 1) - 1 : 0; }
    double operator()(double s) const {
        const Row r = row(samples, cosine, s, terms);
        double sum = 0;
        for (uint32_t k = 0; k < terms; ++k) sum += c[k] * r.value[k];
        return sum;
    }
    /// Largest error at samples (steps = 1) or at so many places between them.
    double worst(const std::function<double(double)>& f, int steps) const {
        double worst = 0;
        for (uint32_t i = 0; i <= (samples - 1) * steps; ++i) {
            const double s = double(i) / steps;
            worst = std::max(worst, std::abs((*this)(s)-f(x_at(s))));
        }
        return worst;
    }
};

}  // namespace

TEST_CASE("the functions are orthonormal on the samples of every life length") {
    for (uint32_t samples = 1; samples <= max_window_samples; ++samples)
        for (const bool cosine : {false, true}) {
            const uint32_t terms = most_terms(samples, cosine);
            REQUIRE(terms >= 1);
            REQUIRE(terms <= samples);
            double worst = 0;
            std::vector<Row> rows;
            for (uint32_t s = 0; s < samples; ++s) rows.push_back(row(samples, cosine, s, terms));
            for (uint32_t i = 0; i < terms; ++i)
                for (uint32_t j = 0; j <= i; ++j) {
                    double dot = i == j ? -1 : 0;
                    for (const Row& r : rows) dot += double(r.value[i]) * r.value[j];
                    worst = std::max(worst, std::abs(dot));
                }
            INFO("samples ", samples, cosine ? " cosine" : " extension");
            CHECK(worst < 3e-7);  // what rounding to float leaves
        }
}

TEST_CASE("the polynomials that carry motion: orthonormal at every length, and close to the first terms of both bases") {
    constexpr double unit = 4096;
    for (uint32_t n = 2; n <= Polynomials::most; ++n) {
        const auto* p = polynomials.of(n);
        for (uint32_t k = 0; k < carried_terms && k + 1 < n; ++k)
            for (uint32_t l = 0; l <= k; ++l) {
                double product = 0, mean = 0;
                for (uint32_t s = 0; s < n; ++s) product += p[s][k] * p[s][l] / unit / unit / n, mean += p[s][k] / unit / n;
                CAPTURE(n);
                CHECK(std::abs(product - (k == l)) < 1e-3);
                CHECK(std::abs(mean) < 1e-3);
            }
        for (uint32_t k = n - 1; k < carried_terms; ++k)
            for (uint32_t s = 0; s < n; ++s) CHECK(p[s][k] == 0);
        for (const bool cosine : {false, true})
            for (uint32_t k = 1; k <= carried_terms && k < most_terms(n, cosine); ++k) {
                double product = 0;
                for (uint32_t s = 0; s < n; ++s)
                    product += p[s][k - 1] / unit / std::sqrt(double(n)) * row(n, cosine, s, k + 1).value[k];
                CAPTURE(n);
                CAPTURE(k);
                CHECK(product * polynomial_sign(k, cosine ? track_cosine : 0) > (cosine ? 0.78 : 0.98));
            }
    }
}

TEST_CASE("the spline goes through the samples, to the bit") {
    for (uint32_t samples = 1; samples <= max_window_samples; ++samples)
        for (const bool cosine : {false, true})
            for (uint32_t s = 0; s < samples; ++s) {
                const uint32_t terms = most_terms(samples, cosine);
                float value[max_terms];
                basis_row(tables(), samples, cosine, s, terms, value);
                CAPTURE(samples);
                CHECK(std::equal(value, value + terms, row(samples, cosine, s, terms).value));
            }
}

TEST_CASE("closed forms: constant and straight lines at every length, in one and two terms") {
    for (uint32_t samples = 1; samples <= max_window_samples; ++samples) {
        INFO("samples ", samples);
        CHECK(Fit(samples, 1, false, [](double) { return 3.0; }).worst([](double) { return 3.0; }, 16) <
              3e-6);
        const auto line = [](double x) { return 0.5 - 2 * x; };
        if (samples > 1) CHECK(Fit(samples, 2, false, line).worst(line, 16) < 5e-6);
        // The constant's coefficient is mean · √samples.
        CHECK(Fit(samples, 1, false, [](double) { return 1.0; }).c[0] == doctest::Approx(std::sqrt(samples)));
    }
    for (const uint32_t samples : {1u, 5u, 25u})  // DCT-II
        for (uint32_t k = 0; k < most_terms(samples, true); ++k)
            for (uint32_t s = 0; s < samples; ++s)
                CHECK(row(samples, true, s, k + 1).value[k] ==
                      doctest::Approx(std::sqrt((k ? 2.0 : 1.0) / samples) *
                                      std::cos(pi * k * (s + 0.5) / samples))
                          .epsilon(1e-5));
}

TEST_CASE("what lies in the space comes back exactly, and between the samples as near as a cubic is") {
    for (const uint32_t samples : {9u, 16u, 25u, 33u, 49u}) {
        const uint32_t terms = most_terms(samples, false);
        for (uint32_t k = 1; 2 * k + 1 < terms && k <= 6; ++k) {
            INFO("samples ", samples, " harmonic ", k);
            const auto cosine = [k](double x) { return std::cos(k * pi * x / 2); };
            const auto sine = [k](double x) { return std::sin(k * pi * x / 2); };
            CHECK(Fit(samples, 2 * k + 1, false, cosine).worst(cosine, 1) < 1e-5);
            CHECK(Fit(samples, 2 * k + 2, false, sine).worst(sine, 1) < 1e-5);
            // Of a cubic's third order, but in the first and the last interval, whose outer slope is of first order.
            const double turn = k * pi / (samples - 1);  // a sample
            CHECK(Fit(samples, 2 * k + 1, false, cosine).worst(cosine, 16) < turn * turn / 12);
            CHECK(Fit(samples, 2 * k + 2, false, sine).worst(sine, 16) < turn * turn / 12);
        }
    }
}

TEST_CASE("noise is not made louder between the samples, in either basis at full rank") {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> number(-1, 1);
    for (uint32_t samples = 2; samples <= max_terms; ++samples)
        for (const bool cosine : {false, true}) {
            const uint32_t terms = most_terms(samples, cosine);
            std::vector<double> c(terms), at(samples);
            for (double& x : c) x = number(random);
            const auto value = [&](double s) {
                const Row r = row(samples, cosine, s, terms);
                double sum = 0;
                for (uint32_t k = 0; k < terms; ++k) sum += c[k] * r.value[k];
                return sum;
            };
            for (uint32_t s = 0; s < samples; ++s) at[s] = value(s);
            CAPTURE(samples);
            for (uint32_t s = 0; s + 1 < samples; ++s) {
                // Half way between two samples: what both are, and an eighth of how far their neighbours pull.
                const double before = s > 0 ? at[s - 1] : 2 * at[0] - at[1], after = s + 2 < samples ? at[s + 2] : 2 * at[s + 1] - at[s];
                CHECK(value(s + 0.5) == doctest::Approx((9 * (at[s] + at[s + 1]) - before - after) / 16).epsilon(1e-4).scale(1));
                double most = 0;
                for (const double x : {before, at[s], at[s + 1], after}) most = std::max(most, std::abs(x));
                for (double f = 0; f <= 1; f += 1 / 16.0) CHECK(std::abs(value(s + f)) < 1.26 * most + 1e-5);
            }
        }
}

TEST_CASE("convergence is super-algebraic") {
    const std::function<double(double)> signals[] = {[](double x) { return std::exp(x); },
                                                     [](double x) { return std::sin(3 * x + 0.5); }};
    for (const auto& f : signals) {
        const double four = Fit(33, 4, false, f).worst(f, 1), eight = Fit(33, 8, false, f).worst(f, 1),
                     twelve = Fit(33, 12, false, f).worst(f, 1);
        CHECK(eight < four / 64);  // algebraic of order 6 would just do it
        CHECK(twelve < 1e-5);
        CHECK(eight < 2e-3);
        CHECK(twelve < eight / 20);
    }
}

TEST_CASE("the derivative is that of the value, and goes on through the samples; outside, the tangent goes on") {
    for (const uint32_t samples : {2u, 3u, 5u, 25u, 65u})
        for (const bool cosine : {false, true}) {
            const uint32_t terms = std::min(most_terms(samples, cosine), 14u);
            for (double s = 0.5; s < samples - 1; s += 0.7) {
                const Row low = row(samples, cosine, s - 0.01, terms),
                          high = row(samples, cosine, s + 0.01, terms), at = row(samples, cosine, s, terms);
                for (uint32_t k = 0; k < terms; ++k)
                    CHECK(std::abs((high.value[k] - low.value[k]) / 0.02 - at.derivative[k]) < 4e-3);
            }
            for (uint32_t s = 1; s + 1 < samples; ++s) {
                const Row low = row(samples, cosine, s - 1e-7, terms), high = row(samples, cosine, s + 1e-7, terms);
                for (uint32_t k = 0; k < terms; ++k) CHECK(std::abs(high.derivative[k] - low.derivative[k]) < 1e-5);
            }
            const double end = samples - 1;
            const Row last = row(samples, cosine, end, terms), past = row(samples, cosine, end + 0.75, terms),
                      first = row(samples, cosine, 0, terms), before = row(samples, cosine, -0.5, terms);
            for (uint32_t k = 0; k < terms; ++k) {
                CHECK(past.value[k] ==
                      doctest::Approx(last.value[k] + 0.75f * last.derivative[k]).epsilon(1e-4));
                CHECK(before.value[k] ==
                      doctest::Approx(first.value[k] - 0.5f * first.derivative[k]).epsilon(1e-4));
                CHECK(past.derivative[k] == last.derivative[k]);
            }
        }
}

TEST_CASE("what moves evenly does so whatever the times of frames, at its ends and beyond them too") {
    const std::vector<double> times = {0, 0.5, 2, 2.1, 3, 4.5, 5, 5.25, 7};  // the life is samples 1 … 7
    const uint32_t life = 7, terms = most_terms(life, true);
    const auto place = [](double t) { return 3 - 0.8 * t; };
    std::vector<double> c(terms);
    for (uint32_t s = 0; s < life; ++s) {
        const Row r = row(life, true, s, terms);
        for (uint32_t k = 0; k < terms; ++k) c[k] += place(times[s + 1]) * r.value[k];
    }
    for (size_t i = 0; i + 1 < times.size(); ++i)
        for (double f = 0; f < 1; f += 0.125) {
            const double step = times[i + 1] - times[i];
            StepRatios steps;
            if (i > 0) steps.before = (times[i] - times[i - 1]) / step;
            if (i + 2 < times.size()) steps.after = (times[i + 2] - times[i + 1]) / step;
            Row r{};
            spline_row(tables(), life, true, double(i) - 1 + f, steps, terms, r.value, r.derivative);
            double x = 0, v = 0;
            for (uint32_t k = 0; k < terms; ++k) x += c[k] * r.value[k], v += c[k] * r.derivative[k];
            CAPTURE(i);
            CAPTURE(f);
            CHECK(x == doctest::Approx(place(times[i] + f * step)).epsilon(1e-5));
            CHECK(v / step == doctest::Approx(-0.8).epsilon(1e-5));
        }
}

TEST_CASE("a life of one sample is a constant; a second term drifts") {
    for (const bool cosine : {false, true}) {
        const Row at = row(1, cosine, -0.6, 2);
        CHECK(at.value[0] == 1.f);
        CHECK(at.derivative[0] == 0.f);
        CHECK(at.value[1] == -0.6f);
        CHECK(at.derivative[1] == 1.f);
        float sampled[2];
        basis_row(tables(), 1, cosine, 0, 2, sampled);
        CHECK(sampled[0] == 1.f);
        CHECK(sampled[1] == 0.f);
    }
}
