#include "procedural/scan.hpp"

#include <algorithm>
#include <cmath>

#include "procedural/noise.hpp"

namespace raypager {
namespace {

// Along a pulse everything is a function of the height z, which falls. A convex body holds an interval of heights; the pulse enters it at the
// upper end.
struct HeightInterval {
    double low = -INFINITY, high = INFINITY;
    int entered = -1;  // number of the half-space that bounds it above
    bool empty() const { return low >= high; }
    // Keeps the heights at which slope * z + offset <= 0.
    void clip(double slope, double offset, int number) {
        if (slope > 0) {
            const double bound = -offset / slope;
            if (bound < high) high = bound, entered = number;
        } else if (slope < 0) {
            low = std::max(low, -offset / slope);
        } else if (offset > 0) {
            low = INFINITY;
        }
    }
};

struct Hit {
    double z = -INFINITY;
    const CityBox* box = nullptr;
    bool roof = false, along_x = false;  // along_x: a wall whose face runs along x
};

void hit_box(const Pulse& p, const CityBox& box, Hit& nearest) {
    HeightInterval inside;
    inside.low = box.z0;
    inside.clip(-p.slope_x, box.x0 - p.ground_x, 0);
    inside.clip(p.slope_x, p.ground_x - box.x1, 0);
    inside.clip(-p.slope_y, box.y0 - p.ground_y, 1);
    inside.clip(p.slope_y, p.ground_y - box.y1, 1);
    if (inside.empty()) return;
    if (box.ridge > 0) {
        // Two planes that meet over the middle of the shorter side.
        const bool ridge_along_x = box.x1 - box.x0 > box.y1 - box.y0;
        const double half = 0.5 * (ridge_along_x ? box.y1 - box.y0 : box.x1 - box.x0), pitch = box.ridge / half;
        const double middle = 0.5 * (ridge_along_x ? box.y0 + box.y1 : box.x0 + box.x1);
        const double slope = pitch * (ridge_along_x ? p.slope_y : p.slope_x), at = pitch * ((ridge_along_x ? p.ground_y : p.ground_x) - middle);
        const double ridge = box.eaves + box.ridge;
        inside.clip(1 + slope, at - ridge, 2);
        inside.clip(1 - slope, -at - ridge, 2);
    } else {
        inside.clip(1, -box.eaves, 2);
    }
    if (inside.empty() || inside.high <= nearest.z) return;
    nearest = {inside.high, &box, inside.entered == 2, inside.entered == 1};
}

// The heights at which the pulse is inside a crown.
HeightInterval inside_tree(const Pulse& p, const CityTree& tree) {
    const double r = 1 / tree.radius, h = 1 / tree.half_height;
    const double sx = p.slope_x * r, sy = p.slope_y * r, ox = (p.ground_x - tree.x) * r, oy = (p.ground_y - tree.y) * r, oz = -tree.z * h;
    const double a = sx * sx + sy * sy + h * h, b = sx * ox + sy * oy + h * oz, c = ox * ox + oy * oy + oz * oz - 1;
    const double discriminant = b * b - a * c;
    if (discriminant <= 0) return {INFINITY, -INFINITY};
    const double root = std::sqrt(discriminant);
    return {(-b - root) / a, (-b + root) / a};
}

// Depth of the next leaf that the pulse meets: near the surface as a rule, sometimes far inside.
double leaf_depth(Random& random) {
    const double u = random.uniform();
    return 0.9 * u / (1.03 - u);
}

Rgb8 shaded(const Rgb8& color, double factor) {
    Rgb8 result;
    for (size_t c = 0; c < 3; ++c) result[c] = static_cast<uint8_t>(std::clamp(color[c] * factor, 0.0, 255.0));
    return result;
}

uint16_t intensity(double reflectivity, Random& random) {
    return static_cast<uint16_t>(std::clamp(reflectivity * (30000 + 9000 * (random.uniform() + random.uniform() - 1)), 0.0, 65535.0));
}

// Walks over what stands in the cells that a pulse may meet above the ground.
class PulseTracer {
public:
    PulseTracer(const City& city, const Pulse& pulse, Random& random, ScanPoint* returns)
        : city_(city), pulse_(pulse), random_(random), returns_(returns) {}

    uint32_t trace() {
        // Where the pulse meets the ground: it is so flat that each step brings the height several times nearer.
        for (int step = 0; step < 4; ++step) ground_ = city_.ground_height(x_at(ground_), y_at(ground_));
        hit_.z = ground_;
        find_hits();
        add_leaves();
        if (!blocked_) add_surface();
        for (uint32_t i = 0; i < count_; ++i) {
            returns_[i].return_number = static_cast<uint8_t>(i + 1);
            returns_[i].return_count = static_cast<uint8_t>(count_);
        }
        return count_;
    }

private:
    static constexpr size_t max_trees = 6;

    double x_at(double z) const { return pulse_.ground_x + pulse_.slope_x * z; }
    double y_at(double z) const { return pulse_.ground_y + pulse_.slope_y * z; }

    // From the ground upwards, cell by cell, until nothing around is higher.
    void find_hits() {
        double z = ground_;
        uint32_t column = city_.column(x_at(z)), row = city_.row(y_at(z));
        const double ceiling = city_.cell(column, row).near_top;
        while (z < ceiling) {
            const CityCell& cell = city_.cell(column, row);
            if (z < cell.top) meet(cell);
            // Where the pulse leaves the cell.
            const City::Bounds b = city_.bounds(column, row);
            const double leave_x = leave(pulse_.ground_x, pulse_.slope_x, b.x0, b.x1), leave_y = leave(pulse_.ground_y, pulse_.slope_y, b.y0, b.y1);
            z = std::min(leave_x, leave_y);
            if (z >= ceiling) return;
            if (leave_x < leave_y) {
                if (pulse_.slope_x > 0 ? ++column == city_.columns() : column-- == 0) return;
            } else {
                if (pulse_.slope_y > 0 ? ++row == city_.rows() : row-- == 0) return;
            }
        }
    }

    static double leave(double at, double slope, double low, double high) {
        if (slope == 0) return INFINITY;
        return ((slope > 0 ? high : low) - at) / slope;
    }

    void meet(const CityCell& cell) {
        for (const CityBox& box : city_.boxes(cell)) hit_box(pulse_, box, hit_);
        for (const CityTree& tree : city_.trees(cell)) {
            const HeightInterval inside = inside_tree(pulse_, tree);
            if (!inside.empty() && tree_count_ < max_trees) trees_[tree_count_++] = {inside.low, inside.high, &tree};
        }
    }

    // Leaves return a part of the pulse each, and let the rest through.
    void add_leaves() {
        std::sort(trees_, trees_ + tree_count_, [](const Crown& a, const Crown& b) { return a.high > b.high; });
        double last = INFINITY;
        for (size_t i = 0; i < tree_count_ && !blocked_; ++i) {
            double z = std::min(last, trees_[i].high + 0.35 * (random_.uniform() - 0.5));  // a crown is no smooth egg
            for (z -= leaf_depth(random_); z > std::max(trees_[i].low, hit_.z) && !blocked_; z -= 0.4 + leaf_depth(random_)) {
                const CityTree& tree = *trees_[i].tree;
                const double height = (z - tree.z) / tree.half_height;
                last = z - 0.4;
                add(z, high_vegetation, shaded(tree.color, 0.78 + 0.2 * height + 0.3 * random_.uniform()), 0.55 / (1 + count_));
                blocked_ = count_ + 1 >= most_returns || random_.uniform() < 0.3;
            }
        }
    }

    void add_surface() {
        if (hit_.box)
            add_building();
        else
            add_ground();
    }

    void add_building() {
        const CityBox& box = *hit_.box;
        const double x = x_at(hit_.z), y = y_at(hit_.z);
        const double grain = 0.94 + 0.12 * random_.uniform();
        if (hit_.roof) {
            // Rows of tiles on a gable, patches on a flat roof.
            const double pattern = box.ridge > 0 ? 1 : 1 + 0.07 * value_noise(x / 3, y / 3, 5).value;
            add(hit_.z, box.kind, shaded(box.roof, grain * pattern), 0.5 + 0.3 * (box.roof[1] / 255.0));
            return;
        }
        const double along = hit_.along_x ? x - box.x0 : y - box.y0, width = hit_.along_x ? box.x1 - box.x0 : box.y1 - box.y0;
        const double up = (box.eaves - hit_.z) / 3.1, across = along / (width / std::max(1.0, std::floor(width / 2.6)));
        const double floor_part = up - std::floor(up), window_part = across - std::floor(across);
        const bool glass = box.windows && up < std::floor((box.eaves - box.z0) / 3.1) && floor_part > 0.28 && floor_part < 0.74 &&
                           window_part > 0.24 && window_part < 0.76;
        if (!glass) return add(hit_.z, box.kind, shaded(box.wall, grain), 0.45);
        if (random_.uniform() < 0.8) add(hit_.z, box.kind, shaded({58, 70, 84}, grain), 0.12);  // the rest goes in or is mirrored away
    }

    void add_ground() {
        const double x = x_at(ground_), y = y_at(ground_);
        if (city_.in_river(x, y)) {
            if (random_.uniform() < 0.35) add(ground_, water, shaded({52, 78, 86}, 0.95 + 0.1 * random_.uniform()), 0.06);
            return;
        }
        const uint32_t column = city_.column(x), row = city_.row(y);
        const CityCell& cell = city_.cell(column, row);
        const double grain = 0.92 + 0.16 * random_.uniform();
        switch (cell.use) {
            case CellUse::street:
            case CellUse::crossing:
                return add_road(x, y, city_.bounds(column, row), cell.use == CellUse::crossing, grain);
            case CellUse::paved:
                return add(ground_, ground, shaded({146, 142, 136}, grain), 0.4);
            case CellUse::garden:
            case CellUse::park:
                break;
        }
        // Grass, with worn patches; some of it taller.
        const double patch = value_noise(x / 7, y / 7, 9).value + 0.5 * value_noise(x / 1.7, y / 1.7, 10).value;
        const Rgb8 grass = {static_cast<uint8_t>(104 + 22 * patch), static_cast<uint8_t>(122 + 8 * patch), static_cast<uint8_t>(62 + 14 * patch)};
        const bool tall = patch < -0.75;
        add(ground_ + (tall ? 0.6 * random_.uniform() : 0.0), tall ? low_vegetation : ground, shaded(grass, grain), 0.62);
    }

    // Asphalt between pavements, with a broken line along the middle.
    void add_road(double x, double y, const City::Bounds& b, bool crossing, double grain) {
        const bool along_x = b.x1 - b.x0 > b.y1 - b.y0;
        const double across = along_x ? y - b.y0 : x - b.x0, width = along_x ? b.y1 - b.y0 : b.x1 - b.x0, along = along_x ? x : y;
        if (!crossing && (across < 2 || across > width - 2)) return add(ground_, ground, shaded({158, 154, 148}, grain), 0.42);
        const bool line = !crossing && std::abs(across - 0.5 * width) < 0.12 && along / 6 - std::floor(along / 6) < 0.5;
        add(ground_, road, line ? Rgb8{214, 212, 204} : shaded({84, 84, 86}, grain), line ? 0.8 : 0.16);
    }

    void add(double z, PointClass kind, const Rgb8& color, double reflectivity) {
        ScanPoint& point = returns_[count_++];
        point = {};
        point.x = x_at(z);
        point.y = y_at(z);
        // Along the pulse, which is nearly upright.
        point.z = z + 0.015 * random_.bell();
        point.kind = kind;
        point.color = color;
        point.intensity = intensity(reflectivity, random_);
    }

    struct Crown {
        double low, high;
        const CityTree* tree;
    };

    const City& city_;
    const Pulse& pulse_;
    Random& random_;
    ScanPoint* returns_;
    uint32_t count_ = 0;
    double ground_ = City::typical_height;
    Hit hit_;
    Crown trees_[max_trees];
    size_t tree_count_ = 0;
    bool blocked_ = false;
};

}  // namespace

uint32_t scan(const City& city, const Pulse& pulse, Random& random, ScanPoint* returns) { return PulseTracer(city, pulse, random, returns).trace(); }

}  // namespace raypager
