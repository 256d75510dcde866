#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "raypager/scene.hpp"

namespace raypager {
namespace {

using Vector = std::array<double, 3>;

// A few roundings of numbers near 1 in double precision.
constexpr double tolerance = 1e-12;

void expect_near(const Vector& a, const Vector& b, double bound = tolerance) {
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], bound) << "component " << i;
}

TEST(SceneTransform, BasicTransformsMovePoints) {
    expect_near(Transform::translate(1, 2, 3).point(1, 1, 1), {2, 3, 4});
    expect_near(Transform::translate(1, 2, 3).vector(1, 1, 1), {1, 1, 1});
    expect_near(Transform::scale(2, 3, 4).point(1, 1, 1), {2, 3, 4});
    expect_near(Transform::rotate(90, 0, 0, 5).point(1, 0, 0), {0, 1, 0});
    expect_near(Transform::rotate(120, 1, 1, 1).point(1, 0, 0), {0, 1, 0});
    expect_near((Transform::translate(1, 0, 0) * Transform::scale(2, 2, 2)).point(1, 0, 0), {3, 0, 0});
}

TEST(SceneTransform, InverseUndoesRandomTransforms) {
    const unsigned seed = 7;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(-3, 3);
    for (int trial = 0; trial < 200; ++trial) {
        SCOPED_TRACE("seed " + std::to_string(seed) + " trial " + std::to_string(trial));
        const Transform t = Transform::translate(value(random), value(random), value(random)) *
                            Transform::rotate(60 * value(random), value(random), value(random), value(random)) *
                            Transform::scale(0.5 + std::abs(value(random)), -0.5 - std::abs(value(random)), 0.5 + std::abs(value(random)));
        const auto inverse = t.inverse();
        ASSERT_TRUE(inverse);
        const Vector p = {value(random), value(random), value(random)};
        const Vector q = t.point(p[0], p[1], p[2]);
        expect_near(inverse->point(q[0], q[1], q[2]), p, 1e-11);  // condition number up to 7
        EXPECT_TRUE(t.swaps_handedness());
    }
}

TEST(SceneTransform, SingularHasNoInverse) {
    EXPECT_FALSE(Transform::scale(1, 0, 1).inverse());
    EXPECT_FALSE(Transform::scale(NAN, 1, 1).inverse());
    EXPECT_TRUE(Transform().is_identity());
    EXPECT_FALSE(Transform::translate(0, 0, 1e-300).is_identity());
}

TEST(SceneTransform, LookAtIsLeftHandedAlongZ) {
    const auto look = Transform::look_at({0, 0, -5}, {0, 0, 0}, {0, 1, 0});
    ASSERT_TRUE(look);
    expect_near(look->point(0, 0, 0), {0, 0, 5});
    expect_near(look->point(1, 0, 0), {1, 0, 5});  // +x is to the right
    expect_near(look->point(0, 1, 0), {0, 1, 5});
    EXPECT_FALSE(Transform::look_at({1, 2, 3}, {1, 2, 3}, {0, 1, 0}));
    EXPECT_FALSE(Transform::look_at({0, 0, 0}, {0, 2, 0}, {0, -1, 0}));
    EXPECT_FALSE(Transform::look_at({0, 0, 0}, {0, 2, NAN}, {0, 0, 1}));
    // Far-off and tiny vectors are as good as any.
    EXPECT_TRUE(Transform::look_at({0, 0, 0}, {1e200, 0, 0}, {0, 1e-200, 0}));
}

TEST(SceneTransform, CameraSpansTheShorterSide) {
    const auto camera = make_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 90, 200, 100);
    ASSERT_TRUE(camera);
    const float bound = 1e-6f;               // single precision near 1
    EXPECT_NEAR(camera->right.x, 2, bound);  // looking along -z, +x is right in the real world
    EXPECT_NEAR(camera->up.y, 1, bound);
    EXPECT_NEAR(camera->forward.z, -1, bound);
    const auto mirrored = make_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 90, 100, 200, false);
    ASSERT_TRUE(mirrored);
    EXPECT_NEAR(mirrored->right.x, -1, bound);
    EXPECT_NEAR(mirrored->up.y, 2, bound);
    EXPECT_FALSE(make_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 180, 100, 100));
    EXPECT_FALSE(make_camera({0, 0, 5}, {0, 0, 5}, {0, 1, 0}, 40, 100, 100));
    EXPECT_FALSE(make_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40, 0, 100));
}

}  // namespace
}  // namespace raypager
