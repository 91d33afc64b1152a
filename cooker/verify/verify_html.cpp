// SPDX-License-Identifier: MIT
// `rill verify --html`: everything in one file, nothing fetched, readable in print.
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "verify/heat_picture.h"
#include "verify/verify.h"

namespace rill::cooker {
namespace {

std::string format(const char* pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}
std::string escaped(const std::string& text) {
    std::string out;
    for (char c : text) out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
    return out;
}
std::string row(const std::string& name, const std::string& value) {
    return "<tr><th>" + escaped(name) + "</th><td>" + escaped(value) + "</td></tr>\n";
}

/// Lines over the frames, in percent of the diagonal.
std::string error_graph(const Verification& v) {
    constexpr double width = 900, height = 260, left = 60, bottom = 30;
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0;
    double most = v.target_p99 * percent;
    for (const FrameMeasure& f : v.frames)
        if (std::isfinite(f.distance.p99)) most = std::max(most, f.distance.p99 * percent);
    most = most > 0 ? most * 1.1 : 1;
    auto x = [&](size_t i) { return left + (width - left - 10) * (v.frames.size() > 1 ? double(i) / double(v.frames.size() - 1) : 0.5); };
    auto y = [&](double value) { return (height - bottom) * (1 - std::min(std::isfinite(value) ? value : most, most) / most) + 5; };
    std::string svg = "<svg viewBox=\"0 0 900 270\" role=\"img\" aria-label=\"error over frames\">\n";
    for (int tick = 0; tick <= 4; ++tick) {
        const double value = most * tick / 4;
        svg += "<line class=\"grid\" x1=\"60\" x2=\"890\" y1=\"" + format("%.1f", y(value)) + "\" y2=\"" + format("%.1f", y(value)) +
               "\"/><text x=\"54\" y=\"" + format("%.1f", y(value) + 4) + "\" text-anchor=\"end\">" + format("%.3f", value) + " %</text>\n";
    }
    auto line = [&](const char* style, auto value) {
        svg += std::string("<polyline class=\"") + style + "\" points=\"";
        for (size_t i = 0; i < v.frames.size(); ++i) svg += format("%.1f,", x(i)) + format("%.1f ", y(value(v.frames[i]) * percent));
        svg += "\"/>\n";
    };
    line("p99", [](const FrameMeasure& f) { return f.distance.p99; });
    line("mean", [](const FrameMeasure& f) { return f.distance.mean; });
    if (v.target_p99 > 0)
        svg += "<line class=\"target\" x1=\"60\" x2=\"890\" y1=\"" + format("%.1f", y(v.target_p99 * percent)) + "\" y2=\"" +
               format("%.1f", y(v.target_p99 * percent)) + "\"/>\n";
    svg += "<text x=\"60\" y=\"260\">frame " + std::to_string(v.frames.front().number) + "</text><text x=\"890\" y=\"260\" text-anchor=\"end\">" +
           std::to_string(v.frames.back().number) + "</text>\n";
    return svg + "</svg><p><span class=\"key k99\"></span>p99 <span class=\"key kmean\"></span>mean <span class=\"key ktarget\"></span>p99 aimed at</p>\n";
}

/// Share of the surface by distance, quarter octaves.
std::string histogram(const Verification& v) {
    const DistanceHistogram& all = v.totals.histogram;
    double total = 0;
    for (double a : all.area) total += a;
    std::vector<std::pair<double, double>> bars;  // distance, share
    for (size_t i = 0; i + 4 <= all.area.size(); i += 4) {
        const double share = (all.area[i] + all.area[i + 1] + all.area[i + 2] + all.area[i + 3]) / std::max(total, 1e-300);
        const double distance = DistanceHistogram::distance_of(i);
        if ((share > 1e-5 && distance > v.edge * 1e-4) || !bars.empty()) bars.emplace_back(distance, share);
    }
    while (!bars.empty() && bars.back().second <= 1e-5) bars.pop_back();
    if (bars.empty()) return "<p>All distances are zero.</p>\n";
    double most = 0;
    for (const auto& bar : bars) most = std::max(most, bar.second);
    std::string svg = "<svg viewBox=\"0 0 900 200\" role=\"img\" aria-label=\"histogram of distances\">\n";
    const double step = 880.0 / double(bars.size());
    for (size_t i = 0; i < bars.size(); ++i) {
        const double height = 160 * bars[i].second / most;
        svg += "<rect x=\"" + format("%.1f", 10 + step * double(i)) + "\" y=\"" + format("%.1f", 165 - height) + "\" width=\"" +
               format("%.1f", step * 0.85) + "\" height=\"" + format("%.1f", height) + "\"><title>from " + format("%.3g m: ", bars[i].first) +
               format("%.2f %% of the surface", 100 * bars[i].second) + "</title></rect>\n";
        if (i % 8 == 0) svg += "<text x=\"" + format("%.1f", 10 + step * double(i)) + "\" y=\"185\">" + format("%.2g m", bars[i].first) + "</text>\n";
    }
    return svg + "</svg>\n";
}

std::string picture(const std::string& caption, const std::string& png) {
    return "<figure><img alt=\"" + escaped(caption) + "\" src=\"data:image/png;base64," + base64(png) + "\"><figcaption>" + escaped(caption) +
           "</figcaption></figure>\n";
}

std::string worst_frames(const Verification& v, const SequenceReader& source, const AssetDirectory& directory) {
    std::vector<size_t> order(v.frames.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return v.frames[a].distance.p99 > v.frames[b].distance.p99; });
    // Neighbours of the worst frame look like it: take others further off.
    std::vector<size_t> chosen;
    for (size_t i : order) {
        const bool near = std::any_of(chosen.begin(), chosen.end(), [&](size_t c) { return (i > c ? i - c : c - i) < 4; });
        if (!near && chosen.size() < 3) chosen.push_back(i);
    }
    PictureFrame frame;
    for (int a = 0; a < 3; ++a) frame.lower[a] = directory.header.lower[a], frame.upper[a] = directory.header.upper[a];
    const float scale = float(v.target_p99 > 0 ? 2 * v.target_p99 : 2 * v.p99);
    AssetPlayer player(v.asset);
    std::string html;
    for (size_t i : chosen) {
        const FrameMeasure& f = v.frames[i];
        const Mesh mesh = source.read_surface(i), decoded = player.mesh(f.seconds);
        std::vector<float> heat = surface_distance(mesh, SurfaceIndex(mesh), decoded, SurfaceIndex(decoded), true).per_source_vertex;
        heat.resize(mesh.positions.size());
        for (float& h : heat) h = scale > 0 ? h / scale : 0;
        html += "<h3>Frame " + std::to_string(f.number) + ": p99 " + format("%.3g m", f.distance.p99) + ", max " + format("%.3g m", f.distance.max) +
                ", normals " + format("%.2f°", f.distance.normal_degrees) + "</h3><div class=\"row\">" + picture("Source", draw_png(mesh, frame)) +
                picture("Rill", draw_png(decoded, frame)) +
                picture("Distance on the source: blue 0, red " + format("%.3g m and more", scale), draw_png(mesh, frame, &heat)) + "</div>\n";
    }
    return html;
}

std::string details(const Verification& v) {
    if (!v.details) return "";
    const double edges = v.edge > 0 ? 1 / v.edge : 0;
    uint64_t source = 0, decoded = 0;
    for (const FrameMeasure& f : v.frames) source += f.source.large_components, decoded += f.decoded.large_components;
    std::string html = "<h2>Shape, thin liquid, velocity</h2><table>\n";
    html += row("Components larger than " + format("%g cells", large_cells), std::to_string(source) + " in the source, " + std::to_string(decoded) + " decoded");
    for (const CoarseMeasure& m : v.coarse)
        html += row("Cells " + std::to_string(m.times) + " times as coarse",
                    std::to_string(m.open_edges) + " open, " + std::to_string(m.non_manifold_edges) + " non-manifold edges");
    for (size_t i = 0; i < ThinError::classes; ++i)
        html += row("Thinner than " + std::to_string(i + 1) + " point spacings",
                    format("%.2f %% of the surface: ", 100 * v.thin.area_share(i)) + format("mean %.3f, ", v.thin.below[i].mean() * edges) +
                        format("p99 %.3f, ", v.thin.below[i].p99() * edges) + format("max %.3f source edges", v.thin.below[i].max * edges));
    if (v.velocity.degrees.weight > 0)
        html += row("Velocity", format("direction off by %.2f°, ", v.velocity.degrees.mean()) + format("p99 %.1f°; ", v.velocity.degrees.p99()) +
                                    format("length by %.2f %%, ", 100 * v.velocity.length.mean()) + format("p99 %.1f %%", 100 * v.velocity.length.p99()));
    return html + "</table>\n";
}

/// The farthest that anything moves in each substep, one bar each; those that jump are red.
std::string motion(const Verification& v) {
    const Motion& m = v.motion;
    if (m.substeps == 0) return "";
    const double edges = v.edge > 0 ? 1 / v.edge : 0, limit = m.most_smooth();
    std::vector<double> all;
    double most = limit;
    for (const IntervalMotion& interval : m.intervals)
        for (const Displacement& d : interval.substeps) {
            all.push_back(d.max);
            if (std::isfinite(d.max)) most = std::max(most, d.max);
        }
    std::string svg = "<svg viewBox=\"0 0 900 180\" role=\"img\" aria-label=\"largest displacement of each substep\">\n";
    const double step = 880.0 / double(std::max<size_t>(all.size(), 1));
    for (size_t i = 0; i < all.size() && most > 0; ++i) {
        const double height = 170 * std::min(all[i], most) / most;
        svg += std::string("<rect") + (all[i] > limit ? " class=\"jump\"" : "") + " x=\"" + format("%.1f", 10 + step * double(i)) + "\" y=\"" +
               format("%.1f", 175 - height) + "\" width=\"" + format("%.2f", step * 0.85) + "\" height=\"" + format("%.1f", height) + "\"/>\n";
    }
    svg += "</svg>\n";
    return "<h2>Motion between frames</h2>\n" + svg + "<p>The farthest that anything moves in each of " + std::to_string(m.substeps) +
           " substeps a frame, up to " + format("%.3g source edges; ", most * edges) + std::to_string(m.jumps()) +
           " of them (red) by more than thrice the mean frame step of " + format("%.3g edges. ", m.frame.mean() * edges) + "Window borders: " +
           format("p99 %.3f, ", m.border.p99() * edges) + format("max %.3f edges.</p>\n", m.border.max * edges);
}

std::string bytes_by_kind(const nlohmann::json& cook) {
    if (!cook.is_object() || !cook.contains("bytes") || !cook["bytes"].is_object()) return "";
    double total = 0;
    for (const auto& [kind, value] : cook["bytes"].items())
        if (value.is_number()) total += value.get<double>();
    std::string html = "<h2>Bytes by kind</h2><table>\n";
    for (const auto& [kind, value] : cook["bytes"].items())
        if (value.is_number() && total > 0)
            html += "<tr><th>" + escaped(kind) + "</th><td>" + format("%.0f", value.get<double>()) + "</td><td><div class=\"bar\" style=\"width:" +
                    format("%.1f", 4 * 100 * value.get<double>() / total) + "px\"></div></td><td>" +
                    format("%.1f %%", 100 * value.get<double>() / total) + "</td></tr>\n";
    return html + "</table>\n";
}

const char* const style = R"(<style>
body{font:15px/1.45 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}
h1,h2,h3{font-weight:600}table{border-collapse:collapse}th{text-align:left;font-weight:500;padding:.15em 1.5em .15em 0}
td{font-variant-numeric:tabular-nums;padding-right:1em}svg{width:100%;font:11px sans-serif}polyline{fill:none;stroke-width:1.6}
.p99{stroke:#c33}.mean{stroke:#27c}.target{stroke:#888;stroke-dasharray:6 4}.grid{stroke:#ddd}rect,.bar{fill:#58a;background:#58a}
.jump{fill:#c33}.bar{height:.8em}.key{display:inline-block;width:1.5em;height:3px;margin:0 .4em 3px 1em}.k99{background:#c33}.kmean{background:#27c}
.ktarget{background:#888}.row{display:flex;gap:8px}figure{margin:0;flex:1}img{width:100%;border:1px solid #ddd}
figcaption{font-size:12px;color:#555}pre{background:#f5f5f5;padding:1em;overflow:auto}.missed{color:#b00}</style>)";

}  // namespace

std::string to_html(const Verification& v, const SequenceReader& source) {
    const AssetDirectory directory = read_directory(v.asset);
    const nlohmann::json cook = nlohmann::json::parse(directory.settings_json, nullptr, false);
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0;
    std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>rill verify: " + escaped(v.asset) + "</title>\n" +
                       style + "</head><body>\n<h1>" + escaped(v.asset) + "</h1>\n<p>measured against " + escaped(v.input) +
                       "; distances are symmetric and weighted by area, over the surface of all frames</p>\n<table>\n";
    html += row("Frames", std::to_string(v.frames.size()));
    html += row("Bytes per frame", format("%.0f", v.bytes_per_frame));
    html += row("Mean", format("%.3g m = ", v.mean) + format("%.4f %% of the diagonal", v.mean * percent));
    html += row("p99", format("%.3g m = ", v.p99) + format("%.4f %% of the diagonal = ", v.p99 * percent) +
                           format("%.3f source edges", v.edge > 0 ? v.p99 / v.edge : 0));
    html += row("Maximum", format("%.3g m = ", v.max) + format("%.4f %%", v.max * percent));
    html += row("Normal deviation", format("%.2f°", v.normal_degrees));
    html += row("Worst frame", std::to_string(v.frames[v.worst].number));
    html += "</table>\n";
    if (v.target_p99 > 0)
        html += "<p class=\"" + std::string(v.target_met() ? "met" : "missed") + "\">Aimed at p99 " + format("%.3g m", v.target_p99) + " (--error " +
                escaped(v.target) + "): " + (v.target_met() ? "met" : "missed") + ".</p>\n";
    html += "<h2>Error over time</h2>\n" + error_graph(v) + "<h2>Surface by distance</h2>\n" + histogram(v) + details(v) + motion(v);
    html += "<h2>Worst frames</h2>\n" + worst_frames(v, source, directory) + bytes_by_kind(cook);
    if (cook.is_object())
        html += "<h2>Cook</h2><pre>" + escaped(cook.dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) + "</pre>\n";
    return html + "</body></html>\n";
}

}  // namespace rill::cooker
