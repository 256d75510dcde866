// By the tessellator of GLU, the OpenGL utility library, of which nothing else is used: it needs no OpenGL.
#include "import/polygon_glu.hpp"

#include <GL/glu.h>

#include <cmath>
#include <memory>

namespace raypager {
namespace {

struct Corner {
    std::array<double, 3> place;
    uint32_t number;
};

// What the tessellator's callbacks work on.
struct Cut {
    std::vector<Triangle>& triangles;
    Triangle open = {};  // the triangle that comes
    size_t corners = 0;  // of it
    bool failed = false;
};

void take_corner(void* corner, void* data) {
    Cut& cut = *static_cast<Cut*>(data);
    if (corner == nullptr) {
        cut.failed = true;
        return;
    }
    cut.open[cut.corners++] = static_cast<const Corner*>(corner)->number;
    if (cut.corners < 3) return;
    cut.triangles.push_back(cut.open);
    cut.corners = 0;
}

// Called where edges meet. A place at which there is a corner already gets that corner; anywhere else, the outline crosses itself.
void join_corners(GLdouble place[3], void* corners[4], GLfloat[4], void** result, void* data) {
    *result = nullptr;
    for (size_t i = 0; i < 4; ++i) {
        if (corners[i] == nullptr) continue;
        const Corner& corner = *static_cast<const Corner*>(corners[i]);
        // The outline is as large as 1.
        if (std::abs(corner.place[0] - place[0]) + std::abs(corner.place[1] - place[1]) > 1e-12) continue;
        *result = corners[i];
        return;
    }
    static_cast<Cut*>(data)->failed = true;
}

void note_error(GLenum, void* data) { static_cast<Cut*>(data)->failed = true; }
// That there is such a callback makes all that comes triangles, without strips and fans.
void ignore_edge_flag(GLboolean, void*) {}

using AnyFunction = void (*)();

double twice_area(const std::array<double, 2>& a, const std::array<double, 2>& b, const std::array<double, 2>& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Whether the triangles cover what the outline encloses.
bool cover(std::span<const std::array<double, 2>> outline, const std::vector<Triangle>& triangles) {
    double whole = 0, sum = 0;
    for (size_t i = 2; i < outline.size(); ++i) whole += twice_area(outline[0], outline[i - 1], outline[i]);
    for (const Triangle& t : triangles) sum += std::abs(twice_area(outline[t[0]], outline[t[1]], outline[t[2]]));
    return std::abs(sum - whole) <= 1e-6 * std::abs(whole);
}

}  // namespace

bool cut_polygon(std::span<const std::array<double, 2>> outline, std::vector<Triangle>& triangles) {
    triangles.clear();
    const std::unique_ptr<GLUtesselator, decltype(&gluDeleteTess)> tessellator(gluNewTess(), &gluDeleteTess);
    if (!tessellator) return false;
    GLUtesselator* const t = tessellator.get();
    gluTessCallback(t, GLU_TESS_VERTEX_DATA, reinterpret_cast<AnyFunction>(&take_corner));
    gluTessCallback(t, GLU_TESS_COMBINE_DATA, reinterpret_cast<AnyFunction>(&join_corners));
    gluTessCallback(t, GLU_TESS_ERROR_DATA, reinterpret_cast<AnyFunction>(&note_error));
    gluTessCallback(t, GLU_TESS_EDGE_FLAG_DATA, reinterpret_cast<AnyFunction>(&ignore_edge_flag));
    gluTessNormal(t, 0, 0, 1);
    double least[2] = {INFINITY, INFINITY}, most[2] = {-INFINITY, -INFINITY};
    for (const auto& p : outline)
        for (size_t a = 0; a < 2; ++a) {
            least[a] = std::min(least[a], p[a]);
            most[a] = std::max(most[a], p[a]);
        }
    const double size = std::max(most[0] - least[0], most[1] - least[1]);
    if (!(size > 0) || !std::isfinite(size)) return false;
    std::vector<Corner> corners(outline.size());
    for (size_t i = 0; i < outline.size(); ++i)
        corners[i] = {{(outline[i][0] - least[0]) / size, (outline[i][1] - least[1]) / size, 0}, static_cast<uint32_t>(i)};
    Cut cut{triangles};
    gluTessBeginPolygon(t, &cut);
    gluTessBeginContour(t);
    for (Corner& corner : corners) gluTessVertex(t, corner.place.data(), &corner);
    gluTessEndContour(t);
    gluTessEndPolygon(t);
    return !cut.failed && cut.corners == 0 && triangles.size() <= outline.size() - 2 && cover(outline, triangles);
}

}  // namespace raypager
