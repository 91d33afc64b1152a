// SPDX-License-Identifier: MIT
// Decimation by CGAL's Lindstrom–Turk edge collapse, as a program of its own: `rill compare --decimator` runs it. CGAL is
// under the GPL: nothing of it is linked into what ships.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_ratio_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <cstdio>
#include <cstdlib>
#include <map>

#include "frames/open_sequence.h"
#include "writers/frame_writer.h"

namespace {
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Surface = CGAL::Surface_mesh<Point>;
namespace simplify = CGAL::Surface_mesh_simplification;

Surface to_surface(const rill::cooker::Mesh& mesh) {
    Surface surface;
    std::vector<Surface::Vertex_index> vertices;
    for (const glm::vec3& x : mesh.positions) vertices.push_back(surface.add_vertex(Point(x.x, x.y, x.z)));
    for (const auto& t : mesh.triangles) surface.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    return surface;
}

rill::cooker::Mesh to_mesh(const Surface& surface) {
    rill::cooker::Mesh mesh;
    std::map<Surface::Vertex_index, uint32_t> place;
    for (const auto v : surface.vertices()) {
        const Point& p = surface.point(v);
        place[v] = uint32_t(mesh.positions.size());
        mesh.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
    }
    for (const auto f : surface.faces()) {
        rill::cooker::Triangle triangle;
        size_t k = 0;
        for (const auto v : surface.vertices_around_face(surface.halfedge(f))) triangle[k++] = place[v];
        mesh.triangles.push_back(triangle);
    }
    return mesh;
}

}  // namespace

int main(int count, char** words) {
    if (count < 4 || count % 2 != 0) {
        std::fprintf(stderr, "usage: rill-lindstrom-turk IN.ply KEEP OUT.ply [KEEP OUT.ply ...]\n");
        return 1;
    }
    try {
        const Surface source = to_surface(rill::cooker::open_sequence(words[1], {})->read(0));
        for (int i = 2; i + 1 < count; i += 2) {
            Surface surface = source;
            const double keep = std::atof(words[i]);
            if (keep < 1)
                simplify::edge_collapse(surface, simplify::Count_ratio_stop_predicate<Surface>(keep),
                                        CGAL::parameters::get_cost(simplify::LindstromTurk_cost<Surface>())
                                            .get_placement(simplify::LindstromTurk_placement<Surface>()));
            surface.collect_garbage();
            rill::cooker::write_frame(words[i + 1], to_mesh(surface));
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rill-lindstrom-turk: %s\n", error.what());
        return 2;
    }
    return 0;
}
