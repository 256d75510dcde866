// --tune: what the program chooses by the class of a device, changed by name.
#include <gtest/gtest.h>

#include "cli/render_settings.hpp"
#include "cli/tune_option.hpp"
#include "cli/verbs.hpp"

namespace raypager {
namespace {

void expect_refused(const std::string& text, const std::string& named) {
    const auto settings = parse_render_settings({"a.rpb", "-o", "a.pfm", "--tune", text});
    ASSERT_FALSE(settings.ok()) << text;
    EXPECT_EQ(settings.status().exit_code(), 2);
    const std::string& message = settings.status().message();
    EXPECT_TRUE(message.starts_with("render: --tune: ")) << message;
    EXPECT_NE(message.find(named), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(CliTune, ChangesWhatIsNamed) {
    const auto settings = parse_render_settings({"a.rpb", "-o", "a.pfm", "--tune", "max-loads=8,default-slots=2M,pinned-ahead=1M,traffic-kept=0.5"});
    ASSERT_TRUE(settings.ok()) << settings.status().message();
    DeviceProfile profile = profile_of_cores(2);
    const uint32_t rounds = profile.rounds_under_way;
    apply((*settings)->options.tuning.profile, profile);
    EXPECT_EQ(profile.max_loads, 8u);
    EXPECT_EQ(profile.default_slots, 2000000u);
    EXPECT_EQ(profile.pinned_ahead_bytes, 1u << 20);
    EXPECT_EQ(profile.traffic_kept, 0.5);
    EXPECT_EQ(profile.rounds_under_way, rounds);
}

TEST(CliTune, RefusesWhatItDoesNotKnow) {
    expect_refused("loads=8", "'loads'");
    expect_refused("loads=8", "raypager devices --profile");
    expect_refused("max-loads", "NAME=VALUE");
    expect_refused("", "NAME=VALUE");
    expect_refused("max-loads=8,", "NAME=VALUE");
    expect_refused("max-loads=8,max-loads=9", "more than once");
    expect_refused("max-loads=1", "max-loads: '1' is not a whole number from 2 to 1024");
    expect_refused("max-loads=many", "max-loads");
    expect_refused("traffic-kept=1.5", "from 0 to 1");
    expect_refused("pinned-ahead=2000G", "pinned-ahead");
    expect_refused("pinned-ahead=-1", "pinned-ahead");
}

TEST(CliTune, BenchTakesIt) {
    for (const char* verb : {"sweep", "traverse", "policy"}) {
        const Status status = run_bench({verb, "a", "--tune", "nothing=1"});
        EXPECT_EQ(status.exit_code(), 2) << verb;
        EXPECT_NE(status.message().find("--tune: there is no 'nothing'"), std::string::npos) << status.message();
    }
}

}  // namespace
}  // namespace raypager
