// Checkpoints that are damaged, of another render, or cannot be written: an error that names the file, never a wrong picture.
#include <gtest/gtest.h>

#include <cerrno>
#include <cstring>
#include <random>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "render/checkpoint_format.hpp"
#include "support/device_scene.hpp"
#include "support/failing_file_system.hpp"
#include "support/interrupted_render.hpp"
#include "support/small_scene.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

using support::render_rounds;

class CheckpointFiles : public testing::Test {
protected:
    using Header = checkpoint_format::Header;

    void SetUp() override {
        auto file = support::bake_and_open(support::small_scene(12), {}, folder_.path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
        options_.spp = 6;
        options_.tuning.paths = 64;
        hash_ = render(*file_, options_, {})->report.film_hash;
        options_.checkpoint.file = folder_.path() / "render.ckpt";
        ASSERT_FALSE(render_rounds(*file_, options_, 4)->report.complete);
        options_.checkpoint.resume = true;
        auto text = read_text(options_.checkpoint.file);
        ASSERT_TRUE(text.ok());
        good_ = *text;
    }

    void expect_refused(const RenderOptions& options, const std::string& because) const {
        const auto result = render(*file_, options, {});
        ASSERT_FALSE(result.ok()) << "not refused: " << because;
        const std::string& message = result.status().message();
        EXPECT_NE(message.find("render.ckpt"), std::string::npos) << message;
        EXPECT_NE(message.find(because), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }

    Status put(const std::string& bytes) const { return write_text(options_.checkpoint.file, bytes); }

    // The same file with another header, its checksum made right.
    template <class Change>
    std::string with_header(const Change& change) const {
        std::string bytes = good_;
        Header header;
        std::memcpy(&header, bytes.data(), sizeof header);
        change(header);
        header.checksum = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
        std::memcpy(bytes.data(), &header, sizeof header);
        return bytes;
    }

    support::TemporaryFolder folder_;
    support::FailingFileSystem disk_;
    std::shared_ptr<const BlockFile> file_;
    RenderOptions options_;
    std::string good_;
    uint64_t hash_ = 0;
};

TEST_F(CheckpointFiles, of_another_render_are_refused_with_the_reason) {
    RenderOptions other = options_;
    other.seed = 7;
    expect_refused(other, "--seed");
    other = options_;
    other.width = 16;
    other.height = 8;
    expect_refused(other, "--size");
    other = options_;
    other.max_depth = 2;
    expect_refused(other, "--max-depth");
    other = options_;
    other.connection = Connection::roulette;
    expect_refused(other, "--connection");
    other = options_;
    other.camera = file_->scene().camera;
    other.camera->eye.x += 0.001f;
    expect_refused(other, "--camera");
    // The film is that of more samples already.
    ASSERT_TRUE(render(*file_, options_, {}).ok());
    other = options_;
    other.spp = 5;
    expect_refused(other, "--spp");

    auto scene = support::bake_and_open(support::small_scene(13), {}, folder_.path(), "other");
    ASSERT_TRUE(scene.ok());
    file_ = *scene;
    expect_refused(options_, "another scene");
}

TEST_F(CheckpointFiles, of_another_program_are_refused) {
    ASSERT_TRUE(put(with_header([](Header& h) { h.version++; })).ok());
    expect_refused(options_, "version 5");
    ASSERT_TRUE(put(with_header([](Header& h) { std::memcpy(h.program, "99.1", 5); })).ok());
    expect_refused(options_, "99.1");
    ASSERT_TRUE(put(with_header([](Header& h) { h.identity.kernels ^= 1; })).ok());
    expect_refused(options_, "kernels");
}

TEST_F(CheckpointFiles, on_another_device_warn) {
    ASSERT_TRUE(put(with_header([](Header& h) { h.device[0] ^= 1; })).ok());
    std::vector<std::string> warnings;
    RenderCallbacks callbacks;
    callbacks.warning = [&](const std::string& text) { warnings.push_back(text); };
    const auto result = render(*file_, options_, callbacks);
    ASSERT_TRUE(result.ok()) << result.status().message();
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("another device"), std::string::npos) << warnings[0];
}

TEST_F(CheckpointFiles, with_absurd_headers_are_refused) {
    const auto refused = [&](const auto& change) {
        ASSERT_TRUE(put(with_header(change)).ok());
        expect_refused(options_, "damaged");
    };
    refused([](Header& h) { h.sample_count = UINT64_MAX; });
    refused([](Header& h) { h.sample_count = h.next_sample + 1; });
    refused([](Header& h) { h.order.together = 0; });
    refused([](Header& h) { h.order.tile_size = 0; });
    refused([](Header& h) {
        h.order.together = 3;
        h.order.grouped_passes = 65536;  // more than a pixel of the film holds
    });
    refused([](Header& h) {
        h.sample_count = UINT64_MAX / 8;
        h.next_sample = UINT64_MAX;
    });
    refused([](Header& h) { h.film_words = UINT64_MAX; });
    refused([](Header& h) { h.identity.width = h.identity.height = UINT32_MAX; });
    refused([](Header& h) { h.identity.width = 0; });
    refused([](Header& h) { h.identity.film_layers ^= 1; });  // the film has another size
    refused([](Header& h) { h.file_bytes += 4096; });
    refused([](Header& h) { h.gap_count = UINT64_MAX; });
    refused([](Header& h) { h.gap_count = UINT64_MAX / 16; });
    refused([](Header& h) { h.gap_count = 1; });     // what follows is none
    refused([](Header& h) { h.next_sample += 1; });  // the film has another number of samples
    ASSERT_TRUE(put("RAYPCKPT").ok());
    expect_refused(options_, "8 bytes");
    ASSERT_TRUE(put(std::string(10000, 'x')).ok());
    expect_refused(options_, "is not a checkpoint");
}

// Every flipped bit is found, or lies in the padding.
TEST_F(CheckpointFiles, with_flipped_bits_draw_no_wrong_picture) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    uint32_t refused = 0;
    const uint32_t trials = support::thorough() ? 200 : 16;
    for (uint32_t trial = 0; trial < trials; trial++) {
        std::string bytes = good_;
        // Half of them where the header is.
        const size_t at = random() % (trial % 2 ? bytes.size() : sizeof(Header));
        bytes[at] = static_cast<char>(bytes[at] ^ 1 << random() % 8);
        ASSERT_TRUE(put(bytes).ok());
        const auto result = render(*file_, options_, {});
        if (!result.ok()) {
            refused++;
            EXPECT_NE(result.status().message().find("render.ckpt"), std::string::npos) << result.status().message();
        } else {
            EXPECT_EQ(result->report.film_hash, hash_) << "bit flipped in byte " << at;
            EXPECT_GE(at, sizeof(Header)) << "a damaged header was not found";
        }
    }
    EXPECT_GE(refused, trials / 2);
}

TEST_F(CheckpointFiles, that_are_truncated_are_refused) {
    std::mt19937 random(5);
    const int trials = support::thorough() ? 20 : 8;
    for (int trial = 0; trial < trials; trial++) {
        ASSERT_TRUE(put(good_.substr(0, random() % good_.size())).ok());
        expect_refused(options_, "");
    }
    ASSERT_TRUE(put(good_ + "x").ok());
    expect_refused(options_, "bytes but should have");
}

// A full disk costs nothing but a warning: the checkpoint before it stays whole, the render goes on.
TEST_F(CheckpointFiles, that_cannot_be_written_leave_the_old_one_and_the_render_going) {
    options_.checkpoint.every_seconds = 0;
    for (const int64_t nth : {1, 2}) {
        ASSERT_TRUE(put(good_).ok());
        std::vector<std::string> warnings;
        uint32_t rounds = 0;
        std::string before;
        RenderCallbacks callbacks;
        callbacks.warning = [&](const std::string& text) {
            warnings.push_back(text);
            EXPECT_EQ(*read_text(options_.checkpoint.file), before) << "the old checkpoint is gone";
        };
        callbacks.progress = [&](const RenderProgress&) {
            before = *read_text(options_.checkpoint.file);
            if (++rounds == 3) {
                disk_.error_number = ENOSPC;
                disk_.fail_write_in = nth;
            }
        };
        options_.progress_seconds = 0;
        const auto result = render(*file_, options_, callbacks);
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_hash, hash_);
        ASSERT_EQ(warnings.size(), 1u) << "write " << nth;
        EXPECT_NE(warnings[0].find("No space left"), std::string::npos) << warnings[0];
        EXPECT_NE(warnings[0].find("render.ckpt"), std::string::npos) << warnings[0];
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
        EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path() << " was left behind";
}

}  // namespace
}  // namespace raypager
