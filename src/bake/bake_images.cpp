#include "bake/bake_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <utility>

#include "bake/restyle.hpp"
#include "bake/used_images.hpp"
#include "base/parallel.hpp"
#include "base/words.hpp"
#include "store/check_images.hpp"
#include "texture/tiler.hpp"

namespace raypager {
namespace {

// Its tiler's, and what a reader has in hands: rows of tiles of the usual height as they are stored, and as they are converted.
uint64_t memory_of(const ImageShape& shape) {
    constexpr uint64_t reader_rows = 64, reader_bytes = uint64_t{4} << 20;
    return ImageTiler::memory_bytes(shape) + reader_bytes + 2 * reader_rows * shape.width * shape.channels * bytes_of_channel(shape.kind);
}

// Lets as many be at work as have room together, and one always.
class SharedMemory {
public:
    explicit SharedMemory(uint64_t limit) : limit_(limit) {}
    class Part {
    public:
        Part(SharedMemory& memory, uint64_t bytes) : memory_(memory), bytes_(bytes) {
            std::unique_lock lock(memory_.mutex_);
            memory_.given_back_.wait(lock, [&] { return memory_.used_ == 0 || memory_.used_ + bytes_ <= memory_.limit_; });
            memory_.used_ += bytes_;
        }
        Part(const Part&) = delete;
        Part& operator=(const Part&) = delete;
        ~Part() {
            {
                const std::lock_guard lock(memory_.mutex_);
                memory_.used_ -= bytes_;
            }
            memory_.given_back_.notify_all();
        }

    private:
        SharedMemory& memory_;
        const uint64_t bytes_;
    };

private:
    const uint64_t limit_;
    uint64_t used_ = 0;
    std::mutex mutex_;
    std::condition_variable given_back_;
};

class ImageBake {
public:
    ImageBake(const Scene& scene, const ImagePlan& plan, const ImageBaking& settings, BlockSink& sink, std::vector<PageRecord>& pages)
        : scene_(scene), plan_(plan), settings_(settings), sink_(sink), pages_(pages), memory_(settings.host_limit) {
        for (const ImageShape& shape : plan.shapes) all_texels_ += uint64_t{shape.width} * shape.height;
        if (plan.sky) sky_level_.emplace(*plan.sky);
    }

    Status run() {
        return parallel_try(plan_.shapes.size(), 1, [this](size_t first, size_t end) -> Status {
            for (size_t i = first; i < end; i++) RAYPAGER_TRY(bake(i));
            return {};
        });
    }

    // After run().
    std::vector<rp_u32> sky_words() const { return sky_level_ ? sky_level_->words(static_cast<uint32_t>(plan_.used.size())) : std::vector<rp_u32>(); }

private:
    struct Tails {
        std::vector<std::byte> bytes;
        uint32_t left;  // to come
    };

    Status bake(size_t index) {
        const ImageShape& shape = plan_.shapes[index];
        const SharedMemory::Part memory(memory_, memory_of(shape));
        const rp_image& image = plan_.layout.images[index];
        const auto levels = std::span(plan_.layout.levels).subspan(image.first_level, image.levels);
        const auto page = [this](uint32_t number, std::span<const std::byte> bytes) { return sink_.put_page(number, bytes, pages_[number]); };
        const auto tail = [this](uint32_t number, uint32_t at, std::span<const std::byte> bytes) { return put_tail(number, at, bytes); };
        uint32_t rows_told = 0;
        const auto before_rows = [&](uint32_t rows) {
            tell(uint64_t{rows - std::exchange(rows_told, rows)} * shape.width);
            return is_stopped() ? Status::interrupted("stopped by a signal; nothing was written") : Status();
        };
        const bool is_sky = index == plan_.used.size();
        PageTakers takers = {page, tail};
        if (is_sky) takers.row = [this](uint32_t level, std::span<const std::byte> texels) { sky_level_->take(level, texels); };
        RAYPAGER_TRY(tile_image(*(is_sky ? sky_source(*plan_.sky) : scene_.images[plan_.used[index]]), image, levels, takers, before_rows));
        tell(uint64_t{shape.height - rows_told} * shape.width);
        return {};
    }

    // Whoever brings the last tail of a page writes it.
    Status put_tail(uint32_t number, uint32_t at, std::span<const std::byte> bytes) {
        std::vector<std::byte> whole;
        {
            const std::lock_guard lock(mutex_);
            Tails& tails = tails_.try_emplace(number, Tails{std::vector<std::byte>(RP_TEXTURE_PAGE_BYTES), plan_.layout.tails[number]}).first->second;
            std::ranges::copy(bytes, tails.bytes.begin() + at);
            if (--tails.left > 0) return {};
            whole = std::move(tails.bytes);
            tails_.erase(number);
        }
        return sink_.put_page(number, whole, pages_[number]);
    }

    bool is_stopped() const { return settings_.stop && *settings_.stop; }

    void tell(uint64_t texels) {
        if (!settings_.progress) return;
        const std::lock_guard lock(mutex_);
        texels_ += texels;
        settings_.progress(static_cast<double>(texels_) / static_cast<double>(all_texels_));
    }

    const Scene& scene_;
    const ImagePlan& plan_;
    const ImageBaking& settings_;
    BlockSink& sink_;
    std::vector<PageRecord>& pages_;
    SharedMemory memory_;
    std::optional<SkyLevel> sky_level_;
    uint64_t all_texels_ = 0;
    std::mutex mutex_;  // of what follows
    uint64_t texels_ = 0;
    std::map<uint32_t, Tails> tails_;  // pages that are not whole yet
};

}  // namespace

Result<ImagePlan> plan_images(const Scene& scene, const BakeOptions& options) {
    ImagePlan plan;
    plan.used = used_images(scene);
    plan.sky = paged_sky(scene, options);
    const auto add = [&](const ImageSource& source) -> Status {
        const auto shape = source.shape();
        if (!shape) return shape.status();
        RAYPAGER_TRY(check_image_shape(*shape, source.name()));
        if (memory_of(*shape) > options.host_limit)
            return Status::failed(fmt::format("{}: an image of {} x {} texels takes {} of memory to bake; give a larger --host-limit", source.name(),
                                              shape->width, shape->height, format_exact_bytes(memory_of(*shape))));
        plan.shapes.push_back(*shape);
        return {};
    };
    for (const uint32_t image : plan.used) RAYPAGER_TRY(add(*scene.images[image]));
    if (plan.sky) RAYPAGER_TRY(add(*sky_source(*plan.sky)));
    auto layout = lay_out_images(plan.shapes);
    if (!layout) return layout.status();
    plan.layout = std::move(*layout);
    if (plan.sky) plan.layout.images.back().format = RP_TEXEL_SKY;
    BakedScene textured;
    take_settings(scene, textured);
    textured.images = plan.layout.images;
    RAYPAGER_TRY(check_programs(textured).at("textures"));
    return plan;
}

Status bake_images(const Scene& scene, ImagePlan plan, const ImageBaking& settings, BlockSink& sink, BakedScene& baked) {
    if (plan.shapes.empty()) return {};
    baked.pages.resize(plan.layout.pages);
    RAYPAGER_TRY(sink.reserve_pages(plan.layout.pages));
    ImageBake bake(scene, plan, settings, sink, baked.pages);
    RAYPAGER_TRY(bake.run());
    baked.sky_words = bake.sky_words();
    if (plan.sky) leave_out_sky(baked.light_images, plan.sky->number);
    baked.images = std::move(plan.layout.images);
    baked.image_levels = std::move(plan.layout.levels);
    return {};
}

}  // namespace raypager
