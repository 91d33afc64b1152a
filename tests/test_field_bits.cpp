// SPDX-License-Identifier: MIT
// What decides a bit of the field, and what does not: candidates, batches, instruction sets, the order of points; and that
// broken points and degenerate neighbourhoods leave every value finite.
#include "field_harness.h"
#include "surface/field_kernels.h"

using namespace field_test;

TEST_CASE("candidates beyond reach and the cut into batches change no bit") {
    for (const bool far : {false, true}) {
        CAPTURE(far);
        Cloud cloud;
        add(cloud, torus_of(1, 0.4), 0.12);
        add(cloud, plane_of(1.5, 0.45, -1), 0.12);  // two clusters near the torus' top; open, so that winding wavers
        Random random(11);
        std::vector<Vec> positions;
        if (far) {  // mostly beyond all supports
            for (int i = 0; i < 2000; ++i) positions.push_back((0.5 + 2.5 * random()) * random.direction());
        } else {
            cloud.add_drop({0, 0, 0}, {0.2, 0.1, 0.15});
            for (int i = 0; i < 101; ++i) positions.push_back({0.5 + 0.6 * random(), 0.5 * random(), 0.6 * random() - 0.1});
            for (int i = 0; i < 20; ++i) positions.push_back(0.25 * random.direction());
        }
        const RealField real(cloud);
        std::vector<uint32_t> everything(real.field.point_count + real.field.drop_count);
        for (uint32_t i = 0; i < everything.size(); ++i) everything[i] = i;
        const auto tight = candidates_of(real.field, box_of(positions));
        CHECK((far || tight.size() < everything.size()));
        CHECK(std::is_sorted(tight.begin(), tight.end()));
        const std::vector<Value> values = evaluate(real.field, tight, positions, 10000);
        CHECK(same_bits(values, evaluate(real.field, everything, positions, 10000)));
        for (size_t batch : {1, 7, 32, 33, 64}) CHECK(same_bits(values, evaluate(real.field, everything, positions, batch)));
        std::vector<Value> one_by_one;
        for (const Vec& p : positions) one_by_one.push_back(evaluate(real.field, p));
        CHECK(same_bits(values, one_by_one));
    }
}

TEST_CASE("positions that are reached by more points together than a list holds tell what each does alone") {
    Cloud cloud;
    Random random(17);
    std::vector<Vec> positions;
    for (int i = 0; i < 40; ++i) positions.push_back({double(i % 2), 0.02 * random(), 0.1 * random()});
    for (uint32_t i = 0; i < surface::most_listed + 500; ++i) cloud.add(Vec{double(i % 2), 0, 0} + 0.1 * random.direction(), {0, 0, 1});
    const RealField real(cloud);
    for (uint32_t i = 0; i < real.field.point_count; ++i) real.field.patches[i].inverse = 9;  // half of them reach either end
    std::vector<uint32_t> all(real.field.point_count);
    for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    const std::vector<Value> values = evaluate(real.field, all, positions, 10000);
    std::vector<Value> one_by_one;
    for (const Vec& p : positions) one_by_one.push_back(evaluate(real.field, all, {p}, 1).front());
    CHECK(same_bits(values, one_by_one));
    for (const Value& v : values) CHECK(std::isfinite(v.value));
}

TEST_CASE("at the surface the blend stands; where it is far from zero it is asked and answered as elsewhere") {
    Cloud cloud;
    add(cloud, torus_of(1, 0.4), 0.12);
    add(cloud, plane_of(1.5, 0.45, -1), 0.12);
    const RealField real(cloud);
    Random random(13);
    size_t doubted = 0;
    for (int i = 0; i < 8000; ++i) {
        const float x = float(3 * random() - 1.5), y = float(3 * random() - 1.5), z = float(1.4 * random() - 0.7);
        const auto candidates = candidates_of(real.field, {{x, y, z}, {x, y, z}});
        const auto count = uint32_t(candidates.size());
        float all[4], near[4], blend[4];
        surface::evaluate_gradient(real.field, candidates.data(), count, &x, &y, &z, 1, all, all + 1, all + 2, all + 3, nullptr);
        surface::evaluate_at_surface(real.field, candidates.data(), count, &x, &y, &z, 1, near, near + 1, near + 2, near + 3, nullptr, 0.1f);
        surface::evaluate_at_surface(real.field, candidates.data(), count, &x, &y, &z, 1, blend, blend + 1, blend + 2, blend + 3, nullptr, infinity);
        const float* same = std::fabs(blend[0]) > 0.1f ? all : blend;
        CHECK(std::memcmp(near, same, sizeof(near)) == 0);
        doubted += all[0] != blend[0];
    }
    CHECK(doubted > 100);
}

TEST_CASE("every instruction set gives the bits of the scalar code that rounds as it does") {
    Cloud cloud;
    add(cloud, torus_of(1, 0.4), 0.12);
    add(cloud, plane_of(1.5, 0.45, -1), 0.12);
    RealField real(cloud);
    Random random(12);
    std::vector<Vec> positions;
    for (int i = 0; i < 1000; ++i) positions.push_back({3 * random() - 1.5, 3 * random() - 1.5, 1.4 * random() - 0.7});
    const surface::Kernels* levels[surface::most_kernel_levels];
    const uint32_t count = surface::kernel_levels(levels);
    REQUIRE(count > 0);
    CHECK(real.field.kernels == levels[count - 1]);
    std::vector<Value> reference[2];  // of levels that round twice, and once
    for (uint32_t k = 0; k < count; ++k) {
        CAPTURE(levels[k]->name);
        real.field.kernels = levels[k];
        std::vector<Value> values = evaluate(real.field, positions);
        std::vector<Value>& same = reference[levels[k]->fused];
        if (same.empty()) same = std::move(values);
        else CHECK(same_bits(same, values));
    }
    if (reference[0].empty() || reference[1].empty()) return;
    size_t alike = 0;
    for (size_t i = 0; i < positions.size(); ++i) alike += std::fabs(reference[0][i].value - reference[1][i].value) < 1e-5;
    CHECK(alike > positions.size() * 99 / 100);  // a doubt on its limit may fall either way
    CHECK_FALSE(same_bits(reference[0], reference[1]));
}

TEST_CASE("discs: the cells whose middles lie in the ball and by the plane, whatever the instruction set") {
    const surface::Kernels* levels[surface::most_kernel_levels];
    const uint32_t count = surface::kernel_levels(levels);
    Random random(14);
    size_t marked = 0, wrong = 0;
    for (int i = 0; i < 2000; ++i) {
        Vec n = random.direction();
        if (i % 7 == 0) n = Vec{double(i % 3 == 0), double(i % 3 == 1), double(i % 3 == 2)};
        const float centre[3] = {float(14 * random() - 3), float(14 * random() - 3), float(14 * random() - 3)};
        const float normal[3] = {float(n[0]), float(n[1]), float(n[2])}, radius = float(0.5 + 5 * random());
        uint8_t rows[64] = {}, same[64];
        levels[0]->draw(centre, normal, radius, rows);
        for (uint32_t k = 1; k < count; ++k) {
            CAPTURE(levels[k]->name);
            std::memset(same, 0, sizeof(same));
            levels[k]->draw(centre, normal, radius, same);
            CHECK(std::memcmp(rows, same, sizeof(rows)) == 0);
        }
        const double reach = 0.35 * (std::fabs(n[0]) + std::fabs(n[1]) + std::fabs(n[2])), rounding = 1e-4;
        for (int cell = 0; cell < 512; ++cell) {
            const Vec r = Vec{cell % 8 + 0.5, cell / 8 % 8 + 0.5, cell / 64 + 0.5} - Vec{centre[0], centre[1], centre[2]};
            const double beyond = std::max(std::sqrt(dot(r, r)) - radius, std::fabs(dot(n, r)) - reach);
            const bool is_marked = rows[cell / 8] >> cell % 8 & 1;
            marked += is_marked, wrong += std::fabs(beyond) > rounding && is_marked != (beyond < 0);
        }
    }
    CHECK(marked > 10000);
    CHECK(wrong == 0);
}

TEST_CASE("gather: tells how many there are, and never writes beyond its room") {
    Cloud cloud;
    add(cloud, sphere_of(1), 0.2);
    cloud.add_drop({0, 0, 0}, {0.2, 0.2, 0.2});
    const RealField real(cloud);
    const surface::Box box{{-0.2f, -0.2f, 0.f}, {0.2f, 0.2f, 1.f}};
    const auto all = candidates_of(real.field, box);
    REQUIRE(all.size() > 10);
    CHECK(all.back() == real.field.point_count);
    for (uint32_t room : {0u, 1u, 5u, uint32_t(all.size()) - 1, uint32_t(all.size())}) {
        std::vector<uint32_t> some(room + 1, 12345);
        CHECK(surface::gather(real.field, box, some.data(), room) == all.size());
        CHECK(std::equal(all.begin(), all.begin() + room, some.begin()));
        CHECK(some[room] == 12345);
    }
}

TEST_CASE("the order of the points changes nothing but rounding, the number of fitting ranges not even that") {
    Cloud cloud, reversed;
    const auto samples = poisson_disk(torus_of(1, 0.4), 0.15, 1);
    for (const Sample& s : samples) cloud.add(s.position, s.normal);
    for (size_t i = samples.size(); i-- > 0;) reversed.add(samples[i].position, samples[i].normal);
    RealField one(cloud);
    const RealField other(reversed);
    Random random(2);
    std::vector<Vec> positions;
    for (int i = 0; i < 200; ++i) positions.push_back(torus_of(1, 0.4)(random).position);
    const auto a = evaluate(one.field, positions), b = evaluate(other.field, positions);
    for (size_t i = 0; i < a.size(); ++i) CHECK(std::fabs(a[i].value - b[i].value) < 1e-6);
    for (uint32_t first = 0; first < one.field.point_count; first += 17)
        surface::fit_patches(one.field, first, std::min(first + 17, one.field.point_count));
    CHECK(same_bits(a, evaluate(one.field, positions)));
}

TEST_CASE("degenerate neighbourhoods: every value and gradient finite") {
    const auto point = [](Cloud& c, double x, double y, double z, const Vec& n = {0, 0, 1}) { c.add({x, y, z}, n); };
    std::vector<Cloud> clouds(14);
    point(clouds[1], 0, 0, 0);
    for (int i = 0; i < 2; ++i) point(clouds[2], 0.1 * i, 0, 0);
    for (int i = 0; i < 3; ++i) point(clouds[3], 0.1 * i, 0.1 * (i % 2), 0);
    for (int i = 0; i < 20; ++i) point(clouds[4], 0.05 * i, 0, 0);                       // a line
    for (int i = 0; i < 20; ++i) point(clouds[5], 0, 0, 0.05 * i);                       // along the normal
    for (int i = 0; i < 20; ++i) point(clouds[6], 0, 0, 0);                              // one place
    for (int i = 0; i < 20; ++i) point(clouds[7], 0.1 * (i % 5), 0.1 * (i / 5 % 2), 0);  // pairs
    for (int i = 0; i < 20; ++i) point(clouds[8], 0.1 * i, 0, 0, {0, 0, 0});             // no normal
    for (int i = 0; i < 20; ++i) point(clouds[9], 1e-12 * i, 0, 0);
    for (int i = 0; i < 20; ++i) point(clouds[10], 1e6 * i, 1e6 * (i % 3), 0);
    for (int i = 0; i < 20; ++i) point(clouds[11], 0.1 * (i % 4), 0.1 * (i / 4), 0, {0, 0, i % 2 ? 1.0 : -1.0});
    for (int i = 0; i < 20; ++i) point(clouds[12], i == 7 ? not_a_number : 0.1 * (i % 4), 0.1 * (i / 4), i == 3 ? infinity : 0);
    point(clouds[13], 0, 0, 0), point(clouds[13], 1e9, 0, 0);
    for (size_t i = 0; i < clouds.size(); ++i) {
        CAPTURE(i);
        const RealField real(clouds[i]);
        CHECK(real.field.point_count == clouds[i].activity.size() - (i == 12 ? 2 : 0));
        Random random(i + 1);
        std::vector<Vec> positions = {{0, 0, 0}, {1e8, 0, 0}, {0, 0, 1e-12}};
        for (int k = 0; k < 200; ++k) positions.push_back((k % 2 ? 0.05 : 0.5) * random.direction() + Vec{random(), 0, 0});
        int broken = 0;
        for (const Value& v : evaluate(real.field, positions))
            for (float f : {v.value, v.gradient[0], v.gradient[1], v.gradient[2], v.velocity[0]}) broken += !std::isfinite(f);
        CHECK(broken == 0);
    }
}

TEST_CASE("points that are broken or absent are not there") {
    Cloud cloud;
    add(cloud, sphere_of(1), 0.2);
    const size_t whole = cloud.activity.size();
    cloud.add({not_a_number, 0, 0}, {0, 0, 1});
    cloud.add({0, 0, 2}, {0, not_a_number, 1});
    cloud.add({0, 0, 2}, {0, 0, 1}), cloud.activity.back() = 0;
    cloud.add({0, 0, 2}, {0, 0, 1}), cloud.activity.back() = not_a_number;
    cloud.add_drop({0, 0, 0}, {0.1, 0.1, 0}), cloud.add_drop({0, not_a_number, 0}, {0.1, 0.1, 0.1}), cloud.add_drop({0, 0, 0}, {0.1, 0.1, -0.1});
    const RealField real(cloud);
    CHECK(real.field.point_count == whole);
    CHECK(real.field.drop_count == 0);
}
