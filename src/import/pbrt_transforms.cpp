#include <fmt/format.h>

#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"

namespace raypager {

Status PbrtReader::set_transform(const Directive& directive, const Transform& transform) {
    for (const auto& row : transform.m)
        for (const double x : row)
            if (!std::isfinite(x)) return error(directive, "the transform is not finite");
    if (transforms_active_) state_.transform = transform;
    return {};
}

Status PbrtReader::apply(const Directive& directive, const Transform& transform) { return set_transform(directive, state_.transform * transform); }

Status PbrtReader::identity(const Directive& directive) { return set_transform(directive, Transform()); }

Status PbrtReader::translate(const Directive& directive) {
    double v[3];
    RAYPAGER_TRY(take_numbers(3, v));
    return apply(directive, Transform::translate(v[0], v[1], v[2]));
}

Status PbrtReader::scale(const Directive& directive) {
    double v[3];
    RAYPAGER_TRY(take_numbers(3, v));
    return apply(directive, Transform::scale(v[0], v[1], v[2]));
}

Status PbrtReader::rotate(const Directive& directive) {
    double v[4];
    RAYPAGER_TRY(take_numbers(4, v));
    if (v[1] == 0 && v[2] == 0 && v[3] == 0) return error(directive, "its axis is zero");
    return apply(directive, Transform::rotate(v[0], v[1], v[2], v[3]));
}

Status PbrtReader::look_at(const Directive& directive) {
    double v[9];
    RAYPAGER_TRY(take_numbers(9, v));
    const auto look = Transform::look_at({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]});
    if (!look) return error(directive, "eye and target coincide, or \"up\" points along the view");
    return apply(directive, *look);
}

// Sixteen numbers, column by column; an affine transform.
Status PbrtReader::take_matrix(const Directive& directive, Transform& matrix) {
    const PbrtToken* token = nullptr;
    RAYPAGER_TRY(tokens_->peek(token));
    const bool bracket = token->kind == PbrtTokenKind::open;
    if (bracket) tokens_->take();
    double v[16];
    RAYPAGER_TRY(take_numbers(16, v));
    if (bracket) {
        RAYPAGER_TRY(tokens_->peek(token));
        if (token->kind != PbrtTokenKind::close)
            return tokens_->error(*token, fmt::format("expected ] after sixteen numbers instead of {}", token->describe()));
        tokens_->take();
    }
    for (size_t column = 0; column < 4; ++column)
        for (size_t row = 0; row < 4; ++row) matrix.m[row][column] = v[4 * column + row];
    // The same transform, if only scaled as a whole; rounding in the file may leave a trace of it.
    const double w = matrix.m[3][3];
    if (w == 0 || std::abs(matrix.m[3][0]) + std::abs(matrix.m[3][1]) + std::abs(matrix.m[3][2]) > 1e-9 * std::abs(w))
        return error(directive, "is projective; only affine transforms are supported");
    for (auto& row : matrix.m)
        for (double& x : row) x /= w;
    matrix.m[3] = {0, 0, 0, 1};
    return {};
}

Status PbrtReader::transform(const Directive& directive) {
    Transform matrix;
    RAYPAGER_TRY(take_matrix(directive, matrix));
    return set_transform(directive, matrix);
}

Status PbrtReader::concat_transform(const Directive& directive) {
    Transform matrix;
    RAYPAGER_TRY(take_matrix(directive, matrix));
    return apply(directive, matrix);
}

Status PbrtReader::coordinate_system(const Directive&) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    coordinate_systems_[name] = state_.transform;
    return {};
}

Status PbrtReader::coord_sys_transform(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    const auto found = coordinate_systems_.find(name);
    if (found == coordinate_systems_.end()) {
        warn(directive.location, fmt::format("there is no coordinate system \"{}\"; the transform stays as it is", clipped(name)));
        return {};
    }
    return set_transform(directive, found->second);
}

// Of moving things, the position at the start is used.
Status PbrtReader::active_transform(const Directive& directive) {
    const PbrtToken* token = nullptr;
    RAYPAGER_TRY(tokens_->peek(token));
    const std::string which = token->text;
    if (token->kind != PbrtTokenKind::word || (which != "StartTime" && which != "EndTime" && which != "All"))
        return tokens_->error(*token, fmt::format("expected StartTime, EndTime or All instead of {}", token->describe()));
    tokens_->take();
    transforms_active_ = which != "EndTime";
    if (which != "All") warn(directive.location, "ActiveTransform: motion is not supported; everything stays where it starts");
    return {};
}

}  // namespace raypager
