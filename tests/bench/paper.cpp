// SPDX-License-Identifier: MIT
// rill-bench-paper [DIRECTORY]: Figure 1 and Table 1 of Keeler & Bridson, "Compact Iso-Surface Representation and
// Compression for Fluid Phenomena", with Rill's own field and codec. Prints both beside the paper's figures; with a
// directory also writes README.md and figure1.svg there. Exit code 1: the paper is not beaten; 2: cannot write.
#include <cerrno>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include "cube_coding.h"
#include "log_plot.h"
#include "torus_convergence.h"

namespace rill::bench {
namespace {

constexpr uint32_t cube_points = 92;
/// Coarser points meet the field's limit on curvature, which is no matter of order.
constexpr double asymptotic = 0.15;

struct PaperRow {
    double rte;
    CubeError error;
    double words;
};
constexpr PaperRow paper_rows[] = {
    {0.001, {0.0073, 0.071}, 54e3}, {0.01, {0.0076, 0.070}, 38e3}, {0.1, {0.014, 0.12}, 27e3}};

struct Report {
    std::string text, plot;
    bool beaten = true;
    __attribute__((format(printf, 2, 3))) void add(const char* format, ...) {
        char line[4096];
        va_list arguments;
        va_start(arguments, format);
        std::vsnprintf(line, sizeof line, format, arguments);
        va_end(arguments);
        text += line;
        std::fputs(line, stdout);
        std::fflush(stdout);
    }
};

void add_figure(Report& report) {
    std::vector<double> spacings;
    // From half the tube's radius: points farther apart leave places that no patch reaches.
    for (int k = 0; k < 6; ++k) spacings.push_back(0.5 * torus_tube * std::pow(0.5, k / 2.0));
    const std::vector<TorusError> errors = torus_convergence(spacings);
    std::vector<TorusError> fitted;
    Series mean{"mean error", "#1667b5", {}, 0, 0, asymptotic}, max{"max error", "#c2410c", {}, 0, 0, asymptotic};
    report.add("## Figure 1: convergence on a torus\n\n![Convergence](figure1.svg)\n\n"
               "| spacing | points | mean error | max error |\n|---|---|---|---|\n");
    for (const TorusError& e : errors) {
        report.add("| %.3f | %u | %.2e | %.2e |\n", e.spacing, e.points, e.mean, e.max);
        mean.points.emplace_back(e.spacing, e.mean);
        max.points.emplace_back(e.spacing, e.max);
        if (e.spacing < asymptotic) fitted.push_back(e);
    }
    const Order of_mean = fitted_order(fitted, &TorusError::mean), of_max = fitted_order(fitted, &TorusError::max);
    mean.order = of_mean.order, mean.factor = of_mean.factor;
    max.order = of_max.order, max.factor = of_max.factor;
    report.beaten &= of_mean.order >= 3;
    report.add("\nFitted order: **%.2f** of the mean, **%.2f** of the maximum over the %zu spacings below %g.\n\n"
               "Torus of radius %g and tube %g; Poisson-disk points with exact normals; error "
               "abs(f) / abs(grad f) at 46 080 positions of the true surface, the mean weighted by area. Coarser points "
               "(hollow circles) are not fitted: there the field's limit on curvature acts, which keeps real liquids "
               "free of spikes.\n\n",
               of_mean.order, of_max.order, fitted.size(), asymptotic, torus_radius, torus_tube);
    report.plot = log_plot("Distance of the decoded surface from a torus", "spacing of the points", {max, mean});
}

void add_row(Report& report, const PaperRow& paper, const char* name, const CubeCost& cost, double spatial,
             double full) {
    report.add("| %g | %s | **%.4f** | **%.3f** | **%.1fk** | %.0fk | %.0fk | %s |\n", paper.rte, name,
               cost.error.average, cost.error.max, double(cost.words) / 1e3, spatial / 1e3, full / 1e3,
               cost.bytes ? (std::to_string((cost.bytes + 3) / 4) + " words").c_str() : "");
    report.beaten &= cost.error.average < paper.error.average && cost.error.max < paper.error.max &&
                     double(cost.words) < paper.words;
}

void add_table(Report& report) {
    const CubeMesh mesh = cube_mesh(13, 13, 24), finer = cube_mesh(52, 52, 52);
    std::vector<Point> points = even_points(mesh, cube_points);
    const CubeError scattered = uncoded_error(mesh, points);
    fit_points(mesh, 4, 12, points);
    const CubeError placed = uncoded_error(mesh, points), between = uncoded_error(finer, points);
    const double spatial = 6.0 * cube_points * cube_frames;
    const double full = 3.0 * (double(mesh.positions.size()) + mesh.triangles) * cube_frames;

    report.add("## Table 1: a smoothed cube, turning and travelling for %d frames\n\n"
               "| RTE | | avg error | max error | TC | SC | NC | entropy coded |\n|---|---|---|---|---|---|---|---|\n",
               cube_frames);
    for (const PaperRow& paper : paper_rows) {
        report.add("| %g | paper | %.4f | %.3f | %.0fk | 132k | 3429k | |\n", paper.rte, paper.error.average,
                   paper.error.max, paper.words / 1e3);
        add_row(report, paper, "Rill, four windows", code_in_windows(mesh, points, paper.rte), spatial, full);
        add_row(report, paper, "Rill, one segment", code_in_one_segment(mesh, points, paper.rte), spatial, full);
    }
    report.add("\nWithout time coding the %u points lie %.4f on average and %.3f at most from the %zu vertices; evenly spread "
               "on the surface, before they are fitted, %.4f and %.3f. At %zu other positions of the cube, which the "
               "fit has not seen: %.4f and %.3f.\n\n",
               cube_points, placed.average, placed.max, mesh.positions.size(), scattered.average, scattered.max,
               finer.positions.size(), between.average, between.max);
}

void add_terms(Report& report) {
    report.add("- **Error**: distance from the source's vertices along their normals to the decoded surface; all vertices, "
               "all frames. The paper's points, shape and motion are not published.\n"
               "- **Shape**: side %g, edges and corners rounded by radius %g, as a mesh of 1588 vertices and 3172 triangles "
               "(13 × 13 × 24 cells on the cube, projected).\n"
               "- **Motion**: 1.3 turns about one axis at an even pace and 0.7 about another at a growing one; the centre "
               "travels 4 along, on a wave 2 wide and 1.5 high. Points are carried by the exact motion.\n"
               "- **Points**: spread evenly, then moved and turned by Levenberg-Marquardt with the decoder in the loop.\n"
               "- **TC**, words of the time-coded points. *Four windows*: the shipping codec, windows of 60 frames that "
               "decode alone and share their border frames; birth, death, flags, numbers of terms, mean position and normal, "
               "and every stored coefficient count one word each; RTE/√3 per channel. *One segment*: as in the paper, one "
               "Fourier extension over all 240 frames, coefficients as floats, numbers of terms counted too.\n"
               "- **SC**: 92 points × 6 × 240 frames. **NC**: vertices × 3 and triangles × 3 in every frame.\n"
               "- **Entropy coded**: bytes of the finished chunks / 4, quantised to steps of RTE but no coarser than .01.\n",
               2 * cube_half_side, cube_rounding);
}

bool write_file(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) std::fprintf(stderr, "rill-bench-paper: %s: cannot write: %s\n", path.c_str(), std::strerror(errno));
    return bool(file);
}

}  // namespace
}  // namespace rill::bench

int main(int count, char** arguments) {
    using namespace rill::bench;
    Report report;
    report.add("# The paper, reproduced\n\nFigure 1 and Table 1 of Keeler & Bridson, *Compact Iso-Surface Representation and "
               "Compression for Fluid Phenomena*, computed with Rill's own field and codec. This page and the plot are "
               "written by\n\n    cmake -B build -DRILL_BENCH=ON && cmake --build build --target rill-bench-paper\n"
               "    build/tests/bench/rill-bench-paper content/paper\n\n"
               "(`figure1.png` is the same plot as pixels.)\n\n");
    add_figure(report);
    add_table(report);
    add_terms(report);
    if (count > 1) {
        const std::string directory = arguments[1];
        if (!write_file(directory + "/README.md", report.text) || !write_file(directory + "/figure1.svg", report.plot))
            return 2;
    }
    if (!report.beaten) std::fprintf(stderr, "rill-bench-paper: a figure is not better than the paper's\n");
    return report.beaten ? 0 : 1;
}
