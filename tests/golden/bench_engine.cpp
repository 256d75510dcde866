// Measurements on the engine itself: recording changes no picture, recorded visits do not depend on limit and policy, the replay moves the
// bytes that the engine moved; baselines keep the promises; and a sweep from end to end.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bench/policy_bench.hpp"
#include "cli/bench.hpp"
#include "raypager/baselines.hpp"
#include "reference/scenes.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/test_options.hpp"

namespace raypager {
namespace {

class BenchEngine : public testing::Test {
protected:
    static constexpr uint32_t spp = 4;

    // One baked scene for all tests: diffuse, glass and metal things in a room with several lights.
    static void SetUpTestSuite() {
        folder_ = new support::TemporaryFolder;
        BakeOptions options;
        options.block_bytes = 16 << 10;
        auto file = support::bake_and_open(reference::clutter_small(60, 3, {64, 48}), options, folder_->path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = new std::shared_ptr<const BlockFile>(*file);
        ASSERT_GT(scene().blocks.size(), 16u);
        const auto result = render(**file_, base(), {});
        ASSERT_TRUE(result.ok()) << result.status().message();
        hash_ = result->report.film_hash;
    }
    static void TearDownTestSuite() {
        delete file_;
        delete folder_;
    }

    static support::TestOptions base() {
        support::TestOptions options;
        options.spp = spp;
        options.tuning.paths = 2000;
        return options;
    }
    static const BakedScene& scene() { return (*file_)->scene(); }

    static MeasuredRender run(const support::TestOptions& options) {
        auto result = render(**file_, options, {});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result ? std::move(*result) : MeasuredRender();
    }
    static DemandTrace record(support::TestOptions options, uint64_t paths = UINT64_MAX) {
        options.instruments.record_paths = paths;
        MeasuredRender result = run(options);
        EXPECT_EQ(result.report.film_hash, hash_) << "recording changed the picture";
        EXPECT_TRUE(result.trace.has_value());
        return result.trace ? std::move(*result.trace) : DemandTrace();
    }

    static support::TemporaryFolder* folder_;
    static std::shared_ptr<const BlockFile>* file_;
    static uint64_t hash_;
};
support::TemporaryFolder* BenchEngine::folder_ = nullptr;
std::shared_ptr<const BlockFile>* BenchEngine::file_ = nullptr;
uint64_t BenchEngine::hash_ = 0;

// The heart of it: what a trace holds follows from the rays alone. Blocks that stop a shadow ray are known as far as they were resident.
TEST_F(BenchEngine, visits_do_not_depend_on_limit_policy_and_log_size) {
    support::TestOptions preloaded = base();  // all resident from the first round on: every block that stops a shadow ray is known
    preloaded.tuning.pool_place = PoolPlace::host;
    const DemandTrace whole = record(preloaded);
    EXPECT_EQ(whole.path_count(), uint64_t{scene().width} * scene().height * spp);
    EXPECT_EQ(whole.rays.size(), whole.recorded.rays);
    EXPECT_EQ(whole.recorded.scene_identity, scene().identity());
    support::TestOptions paged = base();
    paged.geometry_limit_percent = 8;
    support::TestOptions swept = paged;
    swept.tuning.policy = PolicyKind::sweep;
    support::TestOptions cramped = paged;  // few slots make a small log, which is full again and again
    cramped.tuning.paths = 64;
    for (const support::TestOptions& options : {paged, swept, cramped}) {
        SCOPED_TRACE(testing::Message() << policy_name(options.tuning.policy) << ", " << options.tuning.paths << " paths");
        const DemandTrace other = record(options);
        EXPECT_EQ(other.path_rays, whole.path_rays);
        ASSERT_EQ(other.rays.size(), whole.rays.size());
        ASSERT_EQ(other.visits.size(), whole.visits.size());
        size_t unknown = 0, stops = 0, shadows = 0;
        for (size_t i = 0; i < whole.rays.size(); i++) {
            const TracedRay &a = whole.rays[i], &b = other.rays[i];
            ASSERT_EQ(std::tuple(a.first_visit, a.visits, a.shadow, a.hit_block), std::tuple(b.first_visit, b.visits, b.shadow, b.hit_block)) << i;
            const auto va = whole.visits_of(a), vb = other.visits_of(b);
            bool stopped_a = false, stopped_b = false;
            for (size_t k = 0; k < va.size(); k++) {
                ASSERT_EQ(va[k].block(), vb[k].block()) << "ray " << i << ", visit " << k;
                ASSERT_TRUE(va[k].stops() || !vb[k].stops()) << "ray " << i << " ends in a block that does not stop it";
                unknown += va[k].stops() && !vb[k].stops();
                stops += va[k].stops();
                stopped_a |= va[k].stops();
                stopped_b |= vb[k].stops();
            }
            ASSERT_EQ(stopped_a, stopped_b) << "ray " << i;
            shadows += a.shadow;
        }
        EXPECT_GT(shadows, 1000u);
        EXPECT_GT(stops, 100u);
        EXPECT_LT(unknown, stops);
    }
}

TEST_F(BenchEngine, a_share_of_the_paths_is_recorded_evenly) {
    const DemandTrace whole = record(base()), part = record(base(), 3000);
    const double share = part.share();
    // 3000 of 12288 paths; the standard deviation of a random choice is 48.
    EXPECT_NEAR(static_cast<double>(part.path_count()), 3000, 250);
    EXPECT_NEAR(static_cast<double>(part.rays.size()) / static_cast<double>(whole.rays.size()), share, 0.1 * share);
}

// The replay goes through the engine's own decisions; what differs is when uploads arrive, which is never the same twice.
// What a render moves depends on when loads arrive, so one beside which the machine did other work tells nothing: one of three has to agree.
TEST_F(BenchEngine, a_replay_moves_the_bytes_that_the_engine_moved) {
    const auto expect_near = [](const auto& ratio, std::string_view what) {
        double first = 0;
        for (int attempt = 0; attempt < 3; attempt++) {
            const double found = ratio();
            if (std::abs(found - 1) <= 0.25) return;
            if (attempt == 0) first = found;
        }
        ADD_FAILURE() << what << ": three times off, first by " << first;
    };
    for (const PolicyName& policy : policy_names) {
        support::TestOptions options = base();
        options.geometry_limit_percent = 20;
        options.tuning.policy = policy.kind;
        expect_near([&] { return bench::check_replay(record(options)).bytes_ratio; }, policy.name);
    }
    // A trace of one policy tells what another one does.
    support::TestOptions lru = base();
    lru.geometry_limit_percent = 20;
    lru.tuning.policy = PolicyKind::lru;
    lru.tuning.traversal = Traversal::ray;  // as renders that are recorded: blocks of the other form have other sizes
    const auto ratio_of_lru = [&] {
        const uint64_t measured = run(lru).report.paging.bytes_loaded;
        const DemandTrace trace = record(base());
        bench::PolicyBenchSettings settings;
        settings.pools = {scene().geometry_bytes(BlockForm::stored) / 5};
        settings.policies = {PolicyKind::lru};
        const auto rows = bench::bench_policies(trace, settings, {});
        EXPECT_LE(rows[0].least, measured);
        return static_cast<double>(rows[0].replay.bytes_loaded) / static_cast<double>(measured);
    };
    expect_near(ratio_of_lru, "lru by another policy's trace");
}

TEST_F(BenchEngine, baselines_end_and_show_the_same_picture) {
    for (const double percent : {20.0, 0.001}) {  // the last: room for the largest block
        support::TestOptions waiting = base();
        waiting.geometry_limit_percent = percent;
        waiting.tuning.wait_for_loads = true;
        waiting.tuning.loads_in_flight = 1;
        waiting.tuning.hold_above_ready = 0.0;
        waiting.tuning.tile_size = 5;
        EXPECT_EQ(run(waiting).report.film_hash, hash_);
        support::TestOptions paper = base();
        use_paper_settings(paper, scene().width, scene().height);
        support::TestOptions roulette = base();
        roulette.connection = Connection::roulette;
        paper.geometry_limit_percent = percent;
        const MeasuredRender paged = run(paper);
        EXPECT_EQ(paged.report.film_hash, run(roulette).report.film_hash);
        EXPECT_EQ(paged.report.paths, 4 * scene().width * scene().height);
        EXPECT_GT(paged.report.paging.evictions, 0u);
    }
    support::TestOptions host = base();
    host.tuning.pool_place = PoolPlace::host;
    host.geometry_limit_percent = 1;  // says nothing there
    const MeasuredRender mapped = run(host);
    EXPECT_EQ(mapped.report.film_hash, hash_);
    EXPECT_EQ(mapped.report.paging.loads, scene().blocks.size());
    EXPECT_GE(mapped.report.peak.host_bytes, scene().geometry_bytes(support::default_form()));
    EXPECT_LT(mapped.report.peak.memory_bytes, run(base()).report.peak.memory_bytes);
    host.host_limit = scene().geometry_bytes(support::default_form()) / 2;
    const auto refused = render(**file_, host, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("--host-limit"), std::string::npos);
}

TEST_F(BenchEngine, the_journal_accounts_for_every_load_and_eviction) {
    support::TestOptions options = base();
    options.geometry_limit_percent = 10;
    options.instruments.keep_journal = true;
    const MeasuredRender result = run(options);
    EXPECT_EQ(result.round_seconds.size(), result.report.paging.rounds);
    EXPECT_TRUE(std::is_sorted(result.round_seconds.begin(), result.round_seconds.end()));
    uint64_t loads = 0, evictions = 0;
    std::vector<bool> there(scene().blocks.size());
    for (const PagingEvent& event : result.journal) {
        ASSERT_NE(there[event.block], event.came);
        there[event.block] = event.came;
        (event.came ? loads : evictions)++;
    }
    EXPECT_EQ(loads, result.report.paging.loads);
    EXPECT_EQ(evictions, result.report.paging.evictions);
    EXPECT_TRUE(run(base()).journal.empty());
}

std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

TEST_F(BenchEngine, sweep_from_end_to_end) {
    const std::filesystem::path out = folder_->path() / "results";
    const Arguments arguments = {(*file_)->path().string(),
                                 "-o",
                                 out.string(),
                                 "--spp",
                                 "2",
                                 "--size",
                                 "32x24",
                                 "--limits",
                                 "100%,10%",
                                 "--policies",
                                 "aged-wants,sweep,paper,host",
                                 "--repeats",
                                 "2",
                                 "--reference-spp",
                                 "8",
                                 "--snapshots",
                                 "0.001"};
    const Status status = run_bench_sweep(arguments);
    ASSERT_TRUE(status.ok()) << status.message();
    const auto json = nlohmann::json::parse(read_file(out / "sweep.json"), nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_EQ(json["same_films"], true);
    EXPECT_EQ(json["variants"].size(), 2u * 3 + 1);
    ASSERT_EQ(json["runs"].size(), 2u * 7);
    for (const auto& run : json["runs"]) {
        ASSERT_FALSE(run["convergence"].empty());
        EXPECT_EQ(run["convergence"].back()[1], 2);
        EXPECT_GT(run["convergence"].back()[2], 0.0);
        if (run["connection"] == "queue") {
            EXPECT_EQ(run["film_hash"], json["runs"][0]["film_hash"]);
        }
        if (run["limit"] == "10%") {
            EXPECT_GT(run["evictions"], 0);
        }
    }
    const std::string csv = read_file(out / "sweep.csv"), residency = read_file(out / "residency.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 15);
    size_t events = 0;  // of the first repeat
    for (size_t i = 0; i < 7; i++) events += json["runs"][i]["loads"].get<size_t>() + json["runs"][i]["evictions"].get<size_t>();
    EXPECT_EQ(std::count(residency.begin(), residency.end(), '\n'), static_cast<ptrdiff_t>(events + 1));
    EXPECT_TRUE(std::filesystem::exists(out / "convergence.csv"));
    // The reference is kept with the scene and found again.
    size_t references = 0;
    std::filesystem::file_time_type made;
    for (const auto& entry : std::filesystem::directory_iterator(folder_->path()))
        if (entry.path().filename().string().starts_with("reference-")) references++, made = entry.last_write_time();
    EXPECT_EQ(references, 1u);
    Arguments again = {arguments.begin(), arguments.begin() + 7};
    again.insert(again.end(), {"--limits", "100%", "--repeats", "1", "--reference-spp", "8"});
    ASSERT_TRUE(run_bench_sweep(again).ok());
    for (const auto& entry : std::filesystem::directory_iterator(folder_->path()))
        if (entry.path().filename().string().starts_with("reference-")) {
            EXPECT_EQ(entry.last_write_time(), made);
        }
}

TEST_F(BenchEngine, policy_bench_from_end_to_end) {
    const std::filesystem::path trace = folder_->path() / "demand.trace", report = folder_->path() / "policy.json";
    support::TestOptions options = base();
    options.geometry_limit_percent = 25;
    ASSERT_TRUE(write_demand_trace(trace, record(options)).ok());
    const Status status = run_bench_policy({trace.string(), "--pools", "50%,100K", "--policies", "lru,aged-wants", "--report", report.string()});
    ASSERT_TRUE(status.ok()) << status.message();
    const auto json = nlohmann::json::parse(read_file(report), nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_EQ(json["rows"].size(), 4u);
    EXPECT_EQ(json["rows"][2]["pool_bytes"], 100 << 10);
    EXPECT_GT(json["rows"][0]["bytes_loaded"], json["rows"][0]["clairvoyant_bytes"].get<uint64_t>() / 2);
    EXPECT_EQ(json["share"], 1.0);
    for (const Arguments& wrong : {Arguments{trace.string(), "--policies", "best"}, Arguments{trace.string(), "--pools", "25%,"}, Arguments{}})
        EXPECT_EQ(run_bench_policy(wrong).exit_code(), 2);
    EXPECT_EQ(run_bench_policy({"absent.trace"}).exit_code(), 1);
    EXPECT_EQ(run_bench_sweep({(*file_)->path().string()}).exit_code(), 2);
    EXPECT_EQ(run_bench_sweep({(*file_)->path().string(), "-o", "x", "--policies", "lru,best"}).exit_code(), 2);
    EXPECT_EQ(run_bench_sweep({(*file_)->path().string(), "-o", "x", "--paths", "0x"}).exit_code(), 2);
}

}  // namespace
}  // namespace raypager
