#include "clouds/point_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/vector.hpp"

namespace raypager {
namespace {

class Filter {
public:
    Filter(std::span<CloudPoint> points, const PointOrder& order, const PointView& view)
        : points_(points), order_(order), view_(view), kept_(points.size(), true) {}

    std::vector<bool> run(int level) {
        visit(0, order_.size(), level);
        return std::move(kept_);
    }

private:
    void visit(size_t begin, size_t end, int level) {
        if (end - begin < 2) return;
        const double size = order_.grid.size(level);
        if (view_.is_in_pixel(cell_corner(order_.grid, order_.keys[begin], level), size)) return merge(begin, end, size);
        if (level > 0) for_each_child(order_, begin, end, level, [&](size_t first, size_t last) { visit(first, last, level - 1); });
    }

    void merge(size_t begin, size_t end, double size) {
        PixelMerge merge(end - begin, size);
        const auto indices = std::span(order_.indices).subspan(begin, end - begin);
        for (const uint32_t i : indices) {
            merge.add(points_[i]);
            kept_[i] = false;
        }
        for (const uint32_t i : indices) merge.compare(points_[i], i);
        points_[merge.number()] = merge.point();
        kept_[merge.number()] = true;
    }

    std::span<CloudPoint> points_;
    const PointOrder& order_;
    const PointView& view_;
    std::vector<bool> kept_;
};

}  // namespace

PointView::PointView(const Camera& camera, uint32_t width, uint32_t height, double margin) : reach_(1 + margin) {
    const Vector right = vector(camera.right), up = vector(camera.up), forward = vector(camera.forward), eye = vector(camera.eye);
    std::copy(eye.begin(), eye.end(), eye_);
    // The rows of the inverse of the matrix with these columns. A valid camera's axes are independent.
    const Vector rows[3] = {cross(up, forward), cross(forward, right), cross(right, up)};
    const double determinant = dot(right, rows[0]);
    for (int i = 0; i < 3; i++)
        for (int a = 0; a < 3; a++) across_[i][a] = rows[i][a] / determinant;
    projection_ = camera.projection;
    pixel_ = std::min(2 * length(right) / width, 2 * length(up) / height);
    if (projection_ == Projection::perspective) pixel_ /= length(forward);
    if (camera.sees_all_around()) {
        // Steps down and, at the horizon, across; of the other map the side of the square that a pixel's solid angle is.
        const double across = 2 * std::numbers::pi * camera.window[2] / width, down = std::numbers::pi * camera.window[3] / height;
        pixel_ = projection_ == Projection::equirectangular ? std::min(across, down) : std::sqrt(2 * across * down / std::numbers::pi);
    }
    if (camera.lens_radius > 0) {
        lens_[0] = camera.lens_radius / length(right);
        lens_[1] = camera.lens_radius / length(up);
        focal_distance_ = camera.focal_distance;
    }
}

bool PointView::sees(const Float3& position) const {
    if (projection_ >= Projection::equirectangular) return true;
    const double p[3] = {position.x - eye_[0], position.y - eye_[1], position.z - eye_[2]};
    double seen[3];
    for (int i = 0; i < 3; i++) seen[i] = across_[i][0] * p[0] + across_[i][1] * p[1] + across_[i][2] * p[2];
    // How wide the picture is there; through the border of a lens, what is out of focus is seen from further aside.
    const double half = projection_ == Projection::orthographic ? reach_ : reach_ * seen[2], blur = std::abs(seen[2] / focal_distance_ - 1);
    return seen[2] > 0 && std::abs(seen[0]) <= half + lens_[0] * blur && std::abs(seen[1]) <= half + lens_[1] * blur;
}

double PointView::distance(const Float3& lower, double size) const {
    const double low[3] = {lower.x, lower.y, lower.z};
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        const double beyond = std::max({low[a] - eye_[a], eye_[a] - (low[a] + size), 0.0});
        sum += beyond * beyond;
    }
    return std::sqrt(sum);
}

PixelMerge::PixelMerge(uint64_t count, double cell_size) : count_(static_cast<double>(count)), across_(0.5 * std::sqrt(3.0) * cell_size) {}

void PixelMerge::add(const CloudPoint& point) {
    const Vector p = vector(point.position);
    for (int a = 0; a < 3; a++) {
        middle_[a] += p[a] / count_;
        color_[a] += std::pow(point.color >> 8 * a & 255u, 2) / count_;
    }
    largest_ = std::max(largest_, point.radius);
}

void PixelMerge::compare(const CloudPoint& point, uint32_t number) {
    const Vector p = vector(point.position), d = {p[0] - middle_[0], p[1] - middle_[1], p[2] - middle_[2]};
    if (!(dot(d, d) < least_)) return;
    least_ = dot(d, d);
    nearest_ = point;
    number_ = number;
}

CloudPoint PixelMerge::point() const {
    CloudPoint result = nearest_;
    result.radius = static_cast<float>(std::max<double>(largest_, std::min(largest_ * std::sqrt(count_), across_)));
    result.color = 0;
    for (int a = 0; a < 3; a++) result.color |= static_cast<uint32_t>(std::lround(std::sqrt(color_[a]))) << 8 * a;
    return result;
}

std::vector<bool> filter_to_pixels(std::span<CloudPoint> points, const PointOrder& order, const PointView& view, int level) {
    return Filter(points, order, view).run(level);
}

}  // namespace raypager
