#include <gtest/gtest.h>

#include <cmath>

#include "raypager/picture.hpp"

namespace raypager {
namespace {

TEST(FilmCompare, EqualPicturesDoNotDiffer) {
    const Image image{2, 1, 3, {0, 1, 2, 3, 4, 5}};
    const auto difference = compare_images(image, image);
    ASSERT_TRUE(difference.ok());
    EXPECT_EQ(difference->rmse, 0);
    EXPECT_EQ(difference->relative_mse, 0);
    EXPECT_EQ(difference->max_difference, 0);
}

TEST(FilmCompare, MeasuresAsItsHeaderSays) {
    const Image a{2, 1, 1, {1, 3}}, b{2, 1, 1, {1.5f, 1}};
    const auto difference = compare_images(a, b);
    ASSERT_TRUE(difference.ok());
    EXPECT_DOUBLE_EQ(difference->rmse, std::sqrt((0.25 + 4) / 2));
    EXPECT_DOUBLE_EQ(difference->relative_mse, (0.25 / (2.25 + 0.01) + 4 / (1 + 0.01)) / 2);
    EXPECT_DOUBLE_EQ(difference->max_difference, 2);
}

TEST(FilmCompare, RefusesWhatCannotBeCompared) {
    const Image image{2, 1, 1, {1, 3}};
    EXPECT_EQ(compare_images(image, {1, 2, 1, {1, 3}}).status().exit_code(), 2) << "usage";
    EXPECT_FALSE(compare_images(image, {2, 1, 3, std::vector<float>(6)}).ok());
    EXPECT_FALSE(compare_images(image, {2, 1, 1, {1, NAN}}).ok());
    EXPECT_FALSE(compare_images({2, 1, 1, {INFINITY, 1}}, image).ok());
    EXPECT_FALSE(compare_images({0, 0, 3, {}}, {0, 0, 3, {}}).ok());
}

}  // namespace
}  // namespace raypager
