#include "render/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "base/hash.hpp"
#include "film/film_layout.hpp"
#include "raypager/abi/film.h"
#include "render/adaptive.hpp"
#include "render/checkpoint_format.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

using namespace checkpoint_format;

uint64_t pixels_of(const RenderIdentity& identity) { return uint64_t{identity.width} * identity.height; }
uint64_t pixel_words(const RenderIdentity& identity) { return FilmLayout(FilmLayers(identity.film_layers), identity.adaptive_error > 0).words(); }

uint64_t header_checksum(const Header& header) { return hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum))); }

template <size_t size>
void store_text(char (&target)[size], std::string_view text) {
    std::memcpy(target, text.data(), std::min(text.size(), size));
}

template <size_t size>
std::string load_text(const char (&source)[size]) {
    return std::string(source, std::find(source, source + size, '\0'));
}

uint64_t finished_samples(std::span<const uint32_t> words, uint64_t stride) {
    uint64_t sum = 0;
    for (size_t at = RP_FILM_COUNT; at < words.size(); at += stride) sum += words[at] & RP_FILM_COUNT_MASK;
    return sum;
}

Header make_header(const CheckpointState& state) {
    Header header = {};
    std::memcpy(header.magic, magic, sizeof magic);
    header.version = version;
    header.endian_mark = endian_mark;
    store_text(header.program, RAYPAGER_VERSION);
    store_text(header.device, state.device);
    header.identity = state.identity;
    header.spp = state.spp;
    header.order = state.order;
    header.next_sample = state.next_sample;
    header.sample_count = state.samples.size();
    header.samples_checksum = hash64(std::as_bytes(std::span(state.samples)));
    header.gap_count = state.gaps.size();
    header.gaps_checksum = hash64(std::as_bytes(std::span(state.gaps)));
    header.film_words = pixels_of(state.identity) * pixel_words(state.identity);
    header.work = state.work;
    header.file_bytes = film_offset(header.gap_count, header.sample_count) + header.film_words * sizeof(uint32_t);
    return header;
}

Status pad_to(OutputFile& file, uint64_t position) { return file.write(std::vector<std::byte>(position - file.position())); }

Status write_film(OutputFile& file, const FilmSource& film, Header& header, uint64_t& finished) {
    Hash64Stream checksum;
    const uint64_t stride = pixel_words(header.identity), most = film_piece_words(stride);
    std::vector<uint32_t> words(std::min(most, header.film_words));
    for (uint64_t first = 0; first < header.film_words; first += most) {
        const std::span<uint32_t> piece = std::span(words).first(std::min(most, header.film_words - first));
        RAYPAGER_TRY(film(first, piece));
        checksum.add(std::as_bytes(piece));
        finished += finished_samples(piece, stride);
        RAYPAGER_TRY(file.write(std::as_bytes(piece)));
    }
    header.film_checksum = checksum.value();
    return {};
}

}  // namespace

WorkDone& WorkDone::operator+=(const WorkDone& more) {
    render_seconds += more.render_seconds;
    stall_seconds += more.stall_seconds;
    for (size_t i = 0; i < std::size(stage_seconds); i++) stage_seconds[i] += more.stage_seconds[i];
    camera_rays += more.camera_rays;
    bounce_rays += more.bounce_rays;
    shadow_rays += more.shadow_rays;
    loads += more.loads;
    evictions += more.evictions;
    bytes_loaded += more.bytes_loaded;
    rounds += more.rounds;
    requests_without_hit += more.requests_without_hit;
    runs += more.runs;
    return *this;
}

WorkDone without_clock(WorkDone work) {
    work.render_seconds = 0;
    work.runs = 0;
    return work;
}

void set_left(CheckpointState& state, std::vector<SampleRange> left, uint64_t limit) {
    state.gaps = merge_ranges(std::move(left));
    state.next_sample = limit;
    if (state.gaps.empty() || state.gaps.back().end != limit) return;
    state.next_sample = state.gaps.back().begin;
    state.gaps.pop_back();
}

std::vector<SampleRange> ranges_left(const CheckpointState& state, uint64_t limit) {
    std::vector<SampleRange> left = state.gaps;
    if (state.next_sample < limit) left.push_back({state.next_sample, limit});
    return left;
}

uint64_t samples_begun(const CheckpointState& state) {
    uint64_t begun = state.next_sample;
    for (const SampleRange& gap : state.gaps) begun -= gap.size();
    return begun;
}

Status write_checkpoint(const std::filesystem::path& path, const CheckpointState& state, const FilmSource& film) {
    Header header = make_header(state);
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    RAYPAGER_TRY(pad_to(*file, page));  // room for the header, which is written last
    RAYPAGER_TRY(file->write(std::as_bytes(std::span(state.gaps))));
    RAYPAGER_TRY(file->write(std::as_bytes(std::span(state.samples))));
    RAYPAGER_TRY(pad_to(*file, film_offset(header.gap_count, header.sample_count)));
    uint64_t finished = 0;
    RAYPAGER_TRY(write_film(*file, film, header, finished));
    if (const uint64_t begun = samples_begun(state); finished + header.sample_count != begun)
        return Status::failed(fmt::format("{}: not written: {} samples are finished and {} under way, but {} were begun; this is a bug",
                                          path.string(), finished, header.sample_count, begun));
    header.checksum = header_checksum(header);
    RAYPAGER_TRY(file->write_at(0, std::as_bytes(std::span(&header, 1))));
    return file->commit();
}

Status CheckpointFile::damaged(const std::string& what) const {
    return Status::failed(fmt::format("{}: {}; the checkpoint is damaged, remove it to start over", file_.path().string(), what));
}

namespace {

// What can be said of a header before anything that it names is looked at.
Status check_header(const InputFile& file, const Header& header) {
    const std::string path = file.path().string();
    if (std::memcmp(header.magic, magic, sizeof magic) != 0)
        return Status::failed(fmt::format("{}: is not a checkpoint: it does not begin with \"RAYPCKPT\"", path));
    if (header.version != version || header.endian_mark != endian_mark)
        return Status::failed(
            fmt::format("{}: has checkpoint version {}, but this program reads version {}; finish the render with the program that "
                        "wrote it, or remove it to start over",
                        path, header.version, version));
    const auto damaged = [&](const char* what) {
        return Status::failed(fmt::format("{}: header: {}; the checkpoint is damaged, remove it to start over", path, what));
    };
    if (header.checksum != header_checksum(header)) return damaged("the checksum is wrong");
    const uint64_t pixels = pixels_of(header.identity);
    if (pixels == 0 || pixels > UINT64_MAX / 256 || header.film_words != pixels * pixel_words(header.identity))
        return damaged("the size of the film is wrong");
    if (!valid_order(header.order, pixels)) return damaged("the order of samples is wrong");
    if (header.sample_count > header.next_sample || header.sample_count > file.size() / sizeof(rp_path_sample))
        return damaged("the number of samples is wrong");
    if (header.gap_count > header.next_sample || header.gap_count > file.size() / sizeof(SampleRange)) return damaged("the number of gaps is wrong");
    if (header.file_bytes != film_offset(header.gap_count, header.sample_count) + header.film_words * sizeof(uint32_t))
        return damaged("the size is wrong");
    if (header.file_bytes != file.size())
        return Status::failed(fmt::format("{}: has {} bytes but should have {}; the checkpoint is truncated or damaged, remove it to start over",
                                          path, file.size(), header.file_bytes));
    return {};
}

bool are_gaps(const std::vector<SampleRange>& gaps, uint64_t end) {
    uint64_t before = 0;
    for (const SampleRange& gap : gaps) {
        if (gap.begin < before || gap.end <= gap.begin || gap.end >= end) return false;
        before = gap.end + 1;
    }
    return true;
}

bool was_begun(const CheckpointState& state, const rp_path_sample& sample) {
    if (sample.pixel >= pixels_of(state.identity)) return false;
    if (state.identity.adaptive_error > 0) return sample.sample < state.spp;  // the film knows more
    const uint64_t number = sample_number(state.order, state.identity.width, state.identity.height, sample.pixel, sample.sample);
    const auto gap = std::upper_bound(state.gaps.begin(), state.gaps.end(), number, [](uint64_t n, const SampleRange& g) { return n < g.end; });
    return number < state.next_sample && (gap == state.gaps.end() || number < gap->begin);
}

}  // namespace

Result<CheckpointFile> CheckpointFile::open(const std::filesystem::path& path) {
    CheckpointFile opened;
    auto file = InputFile::open(path);
    if (!file) return file.status();
    opened.file_ = std::move(*file);
    if (opened.file_.size() < page)
        return Status::failed(fmt::format("{}: is not a checkpoint: it has only {} bytes", path.string(), opened.file_.size()));
    Header header;
    RAYPAGER_TRY(opened.file_.read(0, std::as_writable_bytes(std::span(&header, 1))));
    RAYPAGER_TRY(check_header(opened.file_, header));
    CheckpointState& state = opened.state_;
    state.identity = header.identity;
    state.device = load_text(header.device);
    state.spp = header.spp;
    state.order = header.order;
    state.next_sample = header.next_sample;
    state.work = header.work;
    if (const std::string program = load_text(header.program); program != RAYPAGER_VERSION)
        return Status::failed(
            fmt::format("{}: was written by raypager {}, this is raypager {}, whose picture may differ; finish the render with that "
                        "version, or remove the checkpoint to start over",
                        path.string(), program, RAYPAGER_VERSION));
    state.gaps.resize(header.gap_count);
    RAYPAGER_TRY(opened.file_.read(page, std::as_writable_bytes(std::span(state.gaps))));
    if (hash64(std::as_bytes(std::span(state.gaps))) != header.gaps_checksum || !are_gaps(state.gaps, state.next_sample))
        return opened.damaged(fmt::format("gaps at byte {}: the checksum is wrong, or they are", page));
    state.samples.resize(header.sample_count);
    const uint64_t samples_at = samples_offset(header.gap_count);
    RAYPAGER_TRY(opened.file_.read(samples_at, std::as_writable_bytes(std::span(state.samples))));
    if (hash64(std::as_bytes(std::span(state.samples))) != header.samples_checksum)
        return opened.damaged(fmt::format("samples at byte {}: the checksum is wrong", samples_at));
    if (!std::all_of(state.samples.begin(), state.samples.end(), [&state](const rp_path_sample& s) { return was_begun(state, s); }))
        return opened.damaged("it names a sample that was never begun");
    opened.film_offset_ = film_offset(header.gap_count, header.sample_count);
    opened.film_words_ = header.film_words;
    opened.film_checksum_ = header.film_checksum;
    return opened;
}

Status CheckpointFile::check(const RenderIdentity& identity, uint32_t spp) const {
    const RenderIdentity& mine = state_.identity;
    const auto differs = [this](const std::string& what) {
        return Status::failed(
            fmt::format("{}: cannot go on from here: {}; give what the checkpoint was made with, or name another", file_.path().string(), what));
    };
    if (mine.scene != identity.scene) return differs("it is a checkpoint of another scene, or of one that was baked with other options");
    if (mine.width != identity.width || mine.height != identity.height)
        return differs(fmt::format("its --size is {}x{}, not {}x{}", mine.width, mine.height, identity.width, identity.height));
    if (mine.seed != identity.seed) return differs(fmt::format("its --seed is {}, not {}", mine.seed, identity.seed));
    if (mine.background != identity.background) return differs("its --background is another one");
    if (mine.film_layers != identity.film_layers) {
        const auto layers = [](uint32_t bits) { return bits == 0 ? "none" : film_layer_list(FilmLayers(bits)); };
        return differs(
            fmt::format("its --layers are {}, not {} (--denoise adds albedo and normal)", layers(mine.film_layers), layers(identity.film_layers)));
    }
    if (mine.max_depth != identity.max_depth) return differs(fmt::format("its --max-depth is {}, not {}", mine.max_depth, identity.max_depth));
    const auto connection = [](const RenderIdentity& i) { return i.roulette_connection ? "roulette" : "queue"; };
    if (mine.roulette_connection != identity.roulette_connection)
        return differs(fmt::format("its --connection is {}, not {}", connection(mine), connection(identity)));
    // Bit for bit: what differs in the last one is another picture.
    using CameraWords = std::array<uint32_t, sizeof(rp_camera) / sizeof(uint32_t)>;
    if (std::bit_cast<CameraWords>(mine.camera) != std::bit_cast<CameraWords>(identity.camera)) return differs("its --camera is another one");
    if (mine.kernels != identity.kernels) return differs("it was written by a program with other kernels, whose picture may differ");
    if (mine.adaptive_error != identity.adaptive_error)
        return differs(fmt::format("its --adaptive is {:g}, not {:g}", mine.adaptive_error, identity.adaptive_error));
    if (mine.adaptive_error > 0 && state_.spp != spp)
        return differs(fmt::format("its --spp is {}, not {}, and sampling is adaptive", state_.spp, spp));
    if (mine.adaptive_error > 0)
        return state_.order.grouped_passes == std::min(spp, AdaptiveSampling::first_samples) ? Status() : damaged("the order of samples is wrong");
    const uint64_t pixels = pixels_of(mine), fewest = fewest_passes(state_.order, state_.next_sample, pixels);
    if (fewest > spp) return differs(fmt::format("it was begun for {} samples per pixel at least, more than --spp {}", fewest, spp));
    return {};
}

Status CheckpointFile::read_film(const FilmTarget& target) const {
    Hash64Stream checksum;
    uint64_t finished = 0;
    const uint64_t stride = pixel_words(state_.identity), most = film_piece_words(stride);
    std::vector<uint32_t> words(std::min(most, film_words_));
    for (uint64_t first = 0; first < film_words_; first += most) {
        const std::span<uint32_t> piece = std::span(words).first(std::min(most, film_words_ - first));
        RAYPAGER_TRY(file_.read(film_offset_ + first * sizeof(uint32_t), std::as_writable_bytes(piece)));
        checksum.add(std::as_bytes(piece));
        finished += finished_samples(piece, stride);
        RAYPAGER_TRY(target(first, piece));
    }
    if (checksum.value() != film_checksum_) return damaged(fmt::format("film at byte {}: the checksum is wrong", film_offset_));
    if (finished + state_.samples.size() != samples_begun(state_)) return damaged("the film holds another number of samples than it says");
    return {};
}

}  // namespace raypager
