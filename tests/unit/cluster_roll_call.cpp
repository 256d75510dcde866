#include <gtest/gtest.h>

#include "cluster/roll_call.hpp"

namespace raypager {
namespace {

using Answer = RollCall::Answer;
using Answers = std::vector<std::optional<Answer>>;

TEST(RollCall, NamesThoseThatDoNotAnswer) {
    EXPECT_EQ(RollCall::text(1, Answers{std::nullopt, Answer{3, 12}, Answer{3, 12}}),
              "rank 1 has waited for 12.0 s for rank 0, which does not answer: stopped, hanging or out of reach; the render goes on if it does");
    EXPECT_EQ(RollCall::text(0, Answers{Answer{3, 12}, std::nullopt, Answer{3, 0}, std::nullopt}),
              "rank 0 has waited for 12.0 s for ranks 1, 3, which do not answer: stopped, hanging or out of reach; the render goes on if they do");
    Answers many(12);
    many[0] = {1, 12};
    EXPECT_NE(RollCall::text(0, many).find("ranks 1, 2, 3, 4, 5, 6, 7, 8 and 3 more, which do"), std::string::npos) << RollCall::text(0, many);
}

TEST(RollCall, OneSpeaksForAllThatWait) {
    const Answers answers = {std::nullopt, Answer{3, 11}, Answer{3, 12}, Answer{3, 12}};
    EXPECT_NE(RollCall::text(1, answers), "");
    EXPECT_EQ(RollCall::text(2, answers), "");
    EXPECT_EQ(RollCall::text(3, answers), "");
    EXPECT_NE(RollCall::text(2, Answers{std::nullopt, Answer{3, 1}, Answer{3, 12}}), "") << "rank 1 has hardly waited";
}

TEST(RollCall, HasPatienceWithWork) {
    EXPECT_EQ(RollCall::text(1, Answers{Answer{2, 0}, Answer{3, 40}}), "");
    EXPECT_EQ(RollCall::text(1, Answers{Answer{2, 0}, Answer{3, 80}}), "rank 1 has waited for 1:20 for rank 0, still at work");
    EXPECT_EQ(RollCall::text(1, Answers{Answer{3, 0}, Answer{3, 80}}), "") << "nobody is behind";
}

}  // namespace
}  // namespace raypager
