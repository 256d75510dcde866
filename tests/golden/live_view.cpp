// What the page asks of a render that runs: pictures, other views, other limits, and what is refused. The film stays what it would be.
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "raypager/raypager.hpp"
#include "support/small_scene.hpp"
#include "view/view_loop.hpp"

namespace raypager {
namespace {

using Json = nlohmann::json;

class LiveView : public testing::Test {
protected:
    void SetUp() override {
        BakeOptions bake_options;
        bake_options.block_bytes = 16 << 10;
        auto baked = bake(support::small_scene(30), bake_options);
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        blocks_ = baked->blocks;
        options_.width = 400, options_.height = 240, options_.spp = 200;
        options_.camera = fit_camera(blocks_->camera(), blocks_->width(), blocks_->height(), options_.width, options_.height);
        options_ = options_for_view(*blocks_, options_);
    }
    void TearDown() override { end(); }

    void begin(bool camera_moves = true) {
        loop_ = std::make_unique<ViewLoop>(*blocks_, options_, ViewSettings{"small", 0.5, camera_moves});
        auto session = Session::create(*blocks_, options_);
        ASSERT_TRUE(session.ok()) << session.status().message();
        session_ = std::make_unique<Session>(std::move(*session));
        thread_ = std::thread([this] { status_ = loop_->run(*session_, [this] { return ended_.load(); }); });
        while (state()["phase"] == "starting") std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    void end() {
        ended_ = true;
        if (thread_.joinable()) thread_.join();
        if (loop_) loop_->close();
    }

    HttpReply ask(const std::string& name, const Query& query = {}) { return reply({false, name, query, ""}); }
    HttpReply tell(const std::string& name, const Json& json) { return reply({true, name, {}, json.dump()}); }
    HttpReply reply(HttpRequest request) {
        auto answer = std::make_shared<std::promise<HttpReply>>();
        auto future = answer->get_future();
        loop_->handle(std::move(request), [answer](HttpReply said) { answer->set_value(std::move(said)); });
        if (future.wait_for(std::chrono::seconds(60)) == std::future_status::ready) return future.get();
        ADD_FAILURE() << "no answer";
        return {};
    }
    Json state() { return Json::parse(ask("state").body); }
    // About it; its pixels are those of the body.
    static Json about(const HttpReply& picture) { return Json::parse(picture.headers.at(0).second); }

    std::optional<Blocks> blocks_;
    RenderOptions options_;
    std::unique_ptr<ViewLoop> loop_;
    std::unique_ptr<Session> session_;
    std::thread thread_;
    std::atomic<bool> ended_{false};
    Status status_;
};

TEST_F(LiveView, shows_pictures_that_get_better) {
    options_.spp = 60000;  // no device is done with these before the test is
    begin();
    double spp = 0;
    uint64_t number = 0;
    for (int i = 0; i < 3; i++) {
        const HttpReply picture = ask("picture", {{"after", std::to_string(number)}});
        ASSERT_EQ(picture.status, 200u);
        const Json said = about(picture);
        EXPECT_GT(said["number"], number);
        EXPECT_GT(said["spp"], spp);
        EXPECT_EQ(picture.body.size(), 400u * 240 * 6);
        number = said["number"];
        spp = said["spp"];
    }
    const Json now = state();
    EXPECT_EQ(now["title"], "small");
    EXPECT_EQ(now["width"], 400);
    EXPECT_EQ(now["exposure"], 0.5);
    EXPECT_EQ(now["blocks"], blocks_->count());
    EXPECT_EQ(ask("").type, "text/html; charset=utf-8");
    EXPECT_EQ(ask("view.js").type, "text/javascript; charset=utf-8");
    EXPECT_EQ(ask("etc").status, 404u);
    EXPECT_EQ(tell("state", {}).status, 404u);
    end();
    EXPECT_TRUE(status_.ok()) << status_.message();
    EXPECT_EQ(ask("state").status, 503u);
    EXPECT_EQ(ask("picture").status, 503u);
}

TEST_F(LiveView, moves_and_comes_back_to_the_same_film) {
    options_.spp = 4;
    begin();
    const std::string camera = state()["camera"];
    ASSERT_FALSE(camera.empty());
    for (const bool moving : {true, true, false}) {
        const HttpReply moved = tell("camera", {{"camera", "0.5,1,3,0,0,0,0,1,0,50"}, {"moving", moving}});
        ASSERT_EQ(moved.status, 200u) << moved.body;
        const uint64_t view = Json::parse(moved.body)["view"];
        Json said;
        while (said.is_null() || said["view"] < view) said = about(ask("picture", {{"after", said.is_null() ? "0" : said["number"].dump()}}));
        EXPECT_EQ(said["width"], moving ? 200 : 400);
        EXPECT_EQ(state()["preview"], moving);
    }
    EXPECT_EQ(state()["camera"], "0.5,1,3,0,0,0,0,1,0,50");
    ASSERT_EQ(tell("camera", {{"camera", camera}, {"moving", false}}).status, 200u);
    while (state()["phase"] != "finished") std::this_thread::sleep_for(std::chrono::milliseconds(10));
    end();
    ASSERT_TRUE(status_.ok()) << status_.message();
    const auto viewed = session_->finish();
    ASSERT_TRUE(viewed.ok()) << viewed.status().message();
    options_.camera = *make_camera(*parse_camera(camera), options_.width, options_.height);
    options_.coarse_first = false;
    const auto rendered = render(*blocks_, options_);
    ASSERT_TRUE(rendered.ok()) << rendered.status().message();
    EXPECT_EQ(viewed->report.film_hash, rendered->report.film_hash);
}

TEST_F(LiveView, goes_on_within_other_limits) {
    options_.spp = 6;
    begin();
    (void)ask("picture");
    const uint64_t pool = state()["pool_bytes"];
    ASSERT_EQ(tell("limit", {{"limit", "40%"}}).status, 200u);
    EXPECT_LT(state()["pool_bytes"], pool);
    EXPECT_EQ(state()["limit"]["percent"], 40);
    const HttpReply refused = tell("limit", {{"limit", "1"}});
    EXPECT_EQ(refused.status, 400u);
    EXPECT_NE(refused.body.find("geometry-limit"), std::string::npos) << refused.body;
    EXPECT_EQ(state()["limit"]["percent"], 40);
    ASSERT_EQ(tell("limit", {{"limit", ""}}).status, 200u);
    EXPECT_EQ(state()["pool_bytes"], pool);
    while (state()["phase"] != "finished") std::this_thread::sleep_for(std::chrono::milliseconds(10));
    end();
    const auto viewed = session_->finish();
    ASSERT_TRUE(viewed.ok()) << viewed.status().message();
    options_.coarse_first = false;
    const auto rendered = render(*blocks_, options_);
    ASSERT_TRUE(rendered.ok()) << rendered.status().message();
    EXPECT_EQ(viewed->report.film_hash, rendered->report.film_hash);
}

TEST_F(LiveView, tells_what_is_there) {
    options_.spp = 60000;  // no device is done with these before the test is
    begin();
    Json pixel;
    while (pixel.is_null() || pixel["samples"] == 0) pixel = Json::parse(ask("pick", {{"x", "201"}, {"y", "203"}}).body);
    EXPECT_GT(pixel["material"], 0);
    EXPECT_GT(pixel["depth"], 0);
    const HttpReply map = ask("blocks");
    EXPECT_EQ(map.body.size(), 32u * blocks_->count());
    for (const HttpReply& refused : {ask("pick"), ask("pick", {{"x", "400"}, {"y", "0"}}), ask("save", {{"format", "gif"}}), tell("camera", "what"),
                                     tell("camera", {{"camera", "1"}}), tell("limit", {{"limit", "much"}}), reply({true, "camera", {}, "{{{{"}),
                                     reply({true, "limit", {}, ""})}) {
        EXPECT_EQ(refused.status, 400u) << refused.body;
        EXPECT_TRUE(Json::parse(refused.body).contains("error"));
    }
    EXPECT_EQ(ask("save", {{"format", "png"}}).status, 500u);  // by a program without a writer for it
    EXPECT_EQ(state()["phase"], "rendering");                  // none of it was its end
}

TEST_F(LiveView, of_a_render_for_a_file_stays_where_it_is) {
    begin(false);
    EXPECT_EQ(tell("camera", {{"camera", "0.5,1,3,0,0,0,0,1,0,50"}, {"moving", false}}).status, 409u);
    EXPECT_EQ(state()["camera_moves"], false);
    EXPECT_EQ(state()["view"], 1);
}

}  // namespace
}  // namespace raypager
