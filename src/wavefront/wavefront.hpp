// The wavefront path tracer: path slots on the device and the stages that drive them, one round after the other.
//   wake -> generate -> extend -> shade -> connect; with streams: wake -> generate -> extend and connect -> shade
// A round takes every ray that can go on as far as it gets. This class knows nothing of policies, files or pictures.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "block/baked_scene.hpp"
#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"
#include "raypager/status.hpp"
#include "wavefront/backend.hpp"
#include "wavefront/geometry_buffers.hpp"
#include "wavefront/round_counters.hpp"
#include "wavefront/sample_numbers.hpp"
#include "wavefront/sample_order.hpp"
#include "wavefront/visit_log.hpp"

namespace raypager {

// What has to lie on the device beside the geometry pool and the page table, in bytes.
struct WavefrontBytes {
    uint64_t scene = 0;                  // top tree, materials, lights, ...
    uint64_t film_row = 0;               // of the film, of one row of pixels
    uint64_t per_slot = 0;               // of one path slot, queues included
    uint64_t largest_part_per_slot = 0;  // of the largest buffer that holds a part of each slot
};
WavefrontBytes wavefront_bytes(const BakedScene& scene, BlockForm form, uint32_t width, const FilmLayout& film = FilmLayout());

// What kernels tell of blocks in addition to the rays that wait for them (abi/path.h, RP_DEMAND_BOUNCES and RP_DEMAND_USED).
struct BlockNotes {
    enum class Use { none, last_round, entries };
    bool bounces = false;
    Use use = Use::none;
    std::string definitions(BlockForm form, uint32_t slots) const;  // " -D..." for kernels that trace rays
};

// The stages whose kernels a render runs, in whatever form the blocks are: what can change a picture (kernels_identity).
inline constexpr std::array<std::string_view, 8> render_stages = {"single_ray/publish",  "single_ray/wake",    "single_ray/generate",
                                                                  "single_ray/extend",   "single_ray/connect", "shading/shade",
                                                                  "shading/count_waits", "stream/all_stages"};

class Wavefront {
public:
    // slabs, with blocks in that form, and page_table outlive the tracer. params.slot_count path slots are made. filled_together: so many (1, 2, 4
    // or 8) are given out at once, with single rays; it decides about speed alone.
    // REQUIRES: blocks are in their stored form if visits are recorded.
    static Result<std::unique_ptr<Wavefront>> create(Device& device, const BakedScene& scene, BlockForm form, const rp_render_params& params,
                                                     const std::vector<Buffer>& slabs, const Buffer& page_table, uint32_t filled_together,
                                                     const BlockNotes& notes, const VisitLogSettings& visits = {});
    // Waits for what is in the queues of kernels: results under way have their place here.
    ~Wavefront() {
        (void)device_.kernels().finish();
        (void)device_.concurrent().finish();
    }
    // From the next round on, so many slots as filled_together of create.
    void fill_together(uint32_t slots) { backend_->fill_together(slots); }
    // Puts all stages of a round into the queues of kernels. At most max_rounds rounds may be under way. page_changes: entries of the page table
    // that are not on the device yet, as rp_page_changes has them. newly_published: blocks that are in the page table with them and were not in the
    // round before, each once.
    Status start_round(uint32_t number, std::span<const rp_page> page_changes, std::span<const uint32_t> newly_published);
    // Waits for the oldest round under way and hands over its counters, and what it tells of blocks: those alone whose requests or use have changed
    // in it, or on whose surfaces rays have ended, each once, in no order. This stays as it is until a round is started.
    Status finish_round(RoundCounters& counters, std::span<const rp_block_demand>& demand);
    // Of the youngest round that was started: when it has ended.
    const Event& last_round_end() const { return buffers_.reports.read((started_ + max_rounds - 1) % max_rounds); }
    static constexpr uint32_t max_rounds = RoundReports::count;
    // The events of the round that has ended, RP_VISIT_WORDS words each. REQUIRES: recording, and no round is under way.
    Status read_visits(std::vector<uint32_t>& words) { return backend_->read_visits(words); }
    // Which samples are begun. What changes here counts from the next round on. REQUIRES: none is cut that a round under way may begin.
    SampleNumbers& numbers() { return numbers_; }
    const SampleNumbers& numbers() const { return numbers_; }
    // By number, as counted by the rounds that have ended.
    uint64_t samples_begun() const { return samples_begun_; }
    // Where sampling is adaptive: numbers from `begin` on are samples first to first + passes - 1 of these pixels (abi/scene.h).
    // REQUIRES: no round is under way, and no sample of an earlier stage is still to begin.
    Status begin_stage(uint64_t begin, uint32_t first, uint32_t passes, std::span<const uint32_t> pixels);

    // Between rounds, the render is: the film, the samples whose paths are under way (none of their radiance is in the film yet), and the
    // number of the next sample. A render that starts with these three ends in the same film as the one that they were taken from.
    // The raw film (abi/film.h), in parts, so that it need not lie in host memory as a whole. It has params().film_rows rows of the picture, from
    // film_first_row on.
    uint64_t film_words() const { return buffers_.film.bytes() / sizeof(uint32_t); }
    Status read_film(uint64_t first_word, std::span<uint32_t> words);
    Status write_film(uint64_t first_word, std::span<const uint32_t> words);
    Status clear_film() { return device_.kernels().fill_zero(buffers_.film, 0, buffers_.film.bytes()); }
    // From the next round on it is that of rows from this one on. REQUIRES: no round is under way, and samples that are begun then are of these rows.
    Status move_film(uint32_t first_row);
    Status read_samples_under_way(std::vector<rp_path_sample>& samples);
    // Samples that come before the next ones by number. REQUIRES: no round is under way, and none that were given before are left.
    void begin_with(std::vector<rp_path_sample> samples) {
        again_list_ = std::move(samples);
        begun_again_ = 0;
    }
    // There will be more samples: slots without one stay free meanwhile. Else they are idle from then on, and cost nothing in the rounds that are
    // left.
    void expect_more(bool more) { expects_more_ = more; }
    // Whether some slots may be idle; then they must be woken before there are more samples.
    bool may_have_idle_slots() const { return may_have_idle_slots_; }
    // REQUIRES: no round is under way.
    Status wake_idle_slots();
    // Whether some of them are still to be begun. Then only one round may be under way: how many it begins is known when it has ended.
    bool begins_again() const { return begun_again_ < again_list_.size(); }
    uint64_t again_left() const { return again_list_.size() - begun_again_; }
    std::vector<rp_path_sample> samples_again_left() const {
        const auto left = samples_again();
        return {left.begin(), left.end()};
    }

    const rp_render_params& params() const { return params_; }
    // Time on the device so far: wake, generate, extend, shade, connect. On GPUs the last and the three before it run beside one another; streams
    // extend and connect in one, which counts as the former.
    const std::array<uint64_t, 5>& stage_nanoseconds() const { return stage_ns_; }
    // Of their sum, so much overlapped.
    uint64_t concurrent_nanoseconds() const { return concurrent_ns_; }
    // How long the device ran none of them between the end of the round before and that of the round that has ended last.
    uint64_t idle_nanoseconds() const { return idle_ns_; }

private:
    Wavefront(Device& device, const rp_render_params& params, GeometryBuffers geometry)
        : device_(device), params_(params), geometry_(std::move(geometry)) {}
    Status upload_scene(const BakedScene& scene);
    Status upload_light_words(const BakedScene& scene, std::vector<rp_light>& lights);
    Status upload_textures(const BakedScene& scene);
    Status allocate_state(const SlotFields& fields);
    FilmLayout film_layout() const { return FilmLayout(params_); }
    Status build_count_waits();
    Status list_samples_again();
    void add_times(const StageEvents& events);
    // Of those that the render began with: the ones that no path has been started for yet.
    std::span<const rp_path_sample> samples_again() const { return std::span(again_list_).subspan(begun_again_); }

    Device& device_;
    rp_render_params params_;
    GeometryBuffers geometry_;
    WavefrontBuffers buffers_;
    std::unique_ptr<Backend> backend_;  // refers to what stands above
    std::optional<Kernel> count_waits_;
    SampleNumbers numbers_;
    uint64_t samples_begun_ = 0;
    std::vector<rp_path_sample> again_list_;
    size_t begun_again_ = 0;
    bool expects_more_ = false, may_have_idle_slots_ = false;
    uint32_t listed_again_ = 0;                   // on the device for the round under way
    std::array<StageEvents, max_rounds> events_;  // of rounds under way
    uint32_t started_ = 0, finished_ = 0;
    std::array<uint64_t, 5> stage_ns_{};
    uint64_t concurrent_ns_ = 0, idle_ns_ = 0;
    uint64_t last_end_ = 0;  // of a stage, on the device's clock
};

}  // namespace raypager
