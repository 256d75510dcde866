#include "clouds/cloud_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <vector>

#include "base/in_order.hpp"
#include "base/parallel.hpp"
#include "clouds/cloud_cells.hpp"
#include "clouds/point_intake.hpp"
#include "clouds/point_sort.hpp"

namespace raypager {
namespace {

// What a point of a unit takes while it is looked at: record, point, key, index, spacing, sphere.
constexpr uint64_t unit_bytes = 128;
// Units are so small that so many of them fit into their share of the limit, within these bounds: larger ones gain nothing.
constexpr uint64_t units_in_memory = 64, smallest_unit = uint64_t{1} << 10, largest_unit = uint64_t{1} << 18;
// Of the limit.
constexpr uint64_t units_share = 4, batch_share = 32;
// A point of a batch that is placed and sorted into ranges, or made a sphere.
constexpr uint64_t batch_bytes = 64;
constexpr uint64_t smallest_batch = uint64_t{1} << 12, largest_batch = uint64_t{1} << 20;

// Which of the points are left, and the number of each among these.
class Ranks {
public:
    explicit Ranks(uint64_t count) : words_((count + 63) / 64) {}
    void keep(uint32_t index) { words_[index / 64] |= uint64_t{1} << index % 64; }
    // After all have been kept that will be.
    void count() {
        before_.resize(words_.size());
        uint64_t sum = 0;
        for (size_t i = 0; i < words_.size(); i++) {
            before_[i] = static_cast<uint32_t>(sum);
            sum += static_cast<uint64_t>(std::popcount(words_[i]));
        }
    }
    uint64_t rank(uint32_t index) const {
        return before_[index / 64] + static_cast<uint64_t>(std::popcount(words_[index / 64] & ((uint64_t{1} << index % 64) - 1)));
    }

private:
    std::vector<uint64_t> words_;
    std::vector<uint32_t> before_;  // kept in earlier words
};

class Streamer {
public:
    Streamer(const Shape& shape, const PointRules& rules, const CloudStream& stream, MeshIssues& issues)
        : shape_(shape), rules_(rules), stream_(stream), issues_(issues) {}

    Result<StreamedCloud> run() {
        if (rules_.radius_is_given() && !rules_.filters()) return take_one_by_one();
        RAYPAGER_TRY(survey());
        if (!by_spacing_ && !rules_.filters()) return take_one_by_one();
        const auto points = sort();
        if (!points) return points.status();
        auto cells = CloudCells::create(*points, max_in_unit(), rules_.filters() ? &rules_.view() : nullptr);
        if (!cells) return cells.status();
        RAYPAGER_TRY(look_at_units(*points, *cells));
        RAYPAGER_TRY(number_what_is_left());
        return result_;
    }

private:
    uint64_t memory_of_units() const { return stream_.memory.limit / units_share; }
    uint64_t max_in_unit() const { return std::clamp(memory_of_units() / (units_in_memory * unit_bytes), smallest_unit, largest_unit); }
    size_t units_at_once() const { return std::clamp<uint64_t>(memory_of_units() / (max_in_unit() * unit_bytes), 1, 4 * worker_count()); }
    size_t max_in_batch() const { return std::clamp(stream_.memory.limit / batch_share / batch_bytes, smallest_batch, largest_batch); }
    // Whether each point becomes a sphere, whose number is then its index.
    bool keeps_all() const { return !rules_.filters() && shape_.points->has_color(); }
    Status check_stop() const { return stream_.stop && *stream_.stop ? Status::interrupted("stopped by a signal; nothing was written") : Status(); }

    // Of the whole work, what has been done when each part of it begins.
    static constexpr double taking = 0.15, sorting = 0.4, looking = 0.55, numbering = 0.85;
    void report(double begin, double end, double fraction) const {
        if (stream_.progress) stream_.progress(begin + (end - begin) * std::min(fraction, 1.0));
    }
    static double share(uint64_t done, uint64_t all) { return static_cast<double>(done) / static_cast<double>(std::max<uint64_t>(1, all)); }

    struct Pass {
        double begin, end;  // of the whole work
        PointPlacer placer;
        MeshIssues issues = {};
        uint64_t count = 0;  // of the points that are placed
    };
    // Calls visit(points, index of the first) for the points that are placed, a batch at a time.
    template <class Visit>
    Status for_each_batch(Pass& pass, const Visit& visit) const {
        uint64_t seen = 0;
        UnwrittenVector<CloudPoint> placed;
        const auto take = [&](std::span<const CloudPoint> points) -> Status {
            RAYPAGER_TRY(check_stop());
            report(pass.begin, pass.end, share(seen += points.size(), shape_.points->count()));
            placed.clear();
            RAYPAGER_TRY(pass.placer.place(points, placed));
            if (pass.count + placed.size() > RP_NONE)
                return Status::failed(fmt::format("{}: has more than {} points; split it, or leave some out", shape_.points->name(), RP_NONE - 1));
            const auto first = static_cast<uint32_t>(pass.count);
            pass.count += placed.size();
            return visit(std::span<const CloudPoint>(placed), first);
        };
        const size_t most = max_in_batch();
        return shape_.points->stream(
            [&](std::span<const CloudPoint> piece) -> Status {
                for (size_t at = 0; at < piece.size(); at += most) RAYPAGER_TRY(take(piece.subspan(at, std::min(most, piece.size() - at))));
                return {};
            },
            pass.issues);
    }
    // What a pass counted goes into the result. Only one of them may be counted.
    void count(const Pass& pass) {
        issues_.add(pass.issues);
        result_.culled += pass.placer.culled();
    }

    Result<StreamedCloud> take_one_by_one() {
        Pass pass = {count_ > 0 ? taking : 0, 1, PointPlacer(rules_)};
        UnwrittenVector<SphereRecord> spheres;
        RAYPAGER_TRY(for_each_batch(pass, [&](std::span<const CloudPoint> points, uint32_t) -> Status {
            spheres.clear();
            append_made(spheres, points.size(), issues_, [&](size_t i, MeshIssues& found) -> std::optional<SphereRecord> {
                CloudPoint point = points[i];
                point.radius = rules_.radius(point, 0);
                const auto sphere = rules_.sphere(point, found);
                return sphere ? std::optional(SphereRecord{*sphere, 0}) : std::nullopt;
            });
            for (SphereRecord& record : spheres) record.id = static_cast<uint32_t>(result_.spheres++);
            return stream_.take(spheres, bounds_of(spheres));
        }));
        count(pass);
        return result_;
    }

    // What must be known before points can be sorted.
    Status survey() {
        const uint64_t every = std::max<uint64_t>(1, shape_.points->count() / stream_.memory.sample);
        Pass pass = {0, taking, PointPlacer(rules_)};  // the next one counts
        RAYPAGER_TRY(for_each_batch(pass, [&](std::span<const CloudPoint> points, uint32_t first) -> Status {
            for (uint64_t i = (every - first % every) % every; i < points.size(); i += every)
                sample_.push_back({points[i], static_cast<uint32_t>(first + i)});
            return {};
        }));
        count_ = pass.count;
        bounds_ = pass.placer.bounds();
        by_spacing_ = pass.placer.needs_spacing();
        return {};
    }

    Result<SortedPoints> sort() {
        const PointGrid grid = make_point_grid(bounds_);
        std::vector<PointKey> keys;
        for (const PointRecord& record : sample_) keys.push_back({morton_key(grid, record.point.position), record.index});
        std::vector<PointRecord>().swap(sample_);
        auto sorter = PointSorter::create(grid, count_, std::move(keys), stream_.memory, stream_.spill_beside);
        if (!sorter) return sorter.status();
        Pass pass = {taking, sorting, PointPlacer(rules_)};
        RAYPAGER_TRY(for_each_batch(pass, [&](std::span<const CloudPoint> points, uint32_t first) -> Status {
            if (first + points.size() > count_)
                return Status::failed(shape_.points->name() + ": has more points than when it was read a moment ago; do not change it meanwhile");
            return sorter->add(points, first);
        }));
        count(pass);
        if (pass.count < count_)
            return Status::failed(shape_.points->name() + ": has fewer points than when it was read a moment ago; do not change it meanwhile");
        return sorter->sort(stream_.stop, [this](double fraction) { report(sorting, looking, fraction); });
    }

    struct Unit {
        std::vector<SphereRecord> spheres;  // their ids are indices of points
        Box bounds;                         // of the spheres
        uint64_t merged = 0;
        MeshIssues issues;
        float spacing = 0;
        bool done = false;
        Status status;
    };

    // First all those cells that have what they need; then those few that need to know of the cells around them.
    Status look_at_units(const SortedPoints& points, CloudCells& cells) {
        auto file = SpillFile::create(stream_.spill_beside, SpillFile::for_all_threads);
        if (!file) return file.status();
        BucketWriter left(std::move(*file), size_t{1} << 20);
        Ranks ranks(keeps_all() ? 0 : count_);
        const auto is_looked_at = [&](const CloudCell& cell) { return cell.is_unit && (by_spacing_ || cell.pixel == RP_NONE); };
        RAYPAGER_TRY(look_at(points, cells, left, ranks, is_looked_at, [&](const CloudCell& cell) { return look_at_unit(points, cell, 0); }));
        if (by_spacing_) {
            RAYPAGER_TRY(cells.find_spacing());
            const auto is_pending = [](const CloudCell& cell) { return cell.is_unit && cell.pixel == RP_NONE && cell.spacing == 0; };
            RAYPAGER_TRY(look_at(points, cells, left, ranks, is_pending,
                                 [&](const CloudCell& cell) { return look_at_unit(points, cell, cells.inherited_spacing(cell)); }));
        }
        RAYPAGER_TRY(merge_large_cells(points, cells, left, ranks));
        ranks.count();
        ranks_ = std::move(ranks);
        auto bucket = left.finish();
        if (!bucket) return bucket.status();
        left_ = std::move(*bucket);
        return {};
    }

    // Those of the wanted cells, many at a time; they are handed on in order meanwhile. What is done with needs no more space on disk.
    template <class Filter, class Look>
    Status look_at(const SortedPoints& points, CloudCells& cells, BucketWriter& left, Ranks& ranks, const Filter& wanted, const Look& look) {
        std::vector<uint32_t> order;
        for (uint32_t i = 0; i < cells.cells().size(); i++)
            if (wanted(cells.cells()[i])) order.push_back(i);
        std::ranges::sort(order, {}, [&](uint32_t i) { return cells.cells()[i].begin; });
        const auto look_at_one = [&](size_t i) { return look(cells.cells()[order[i]]); };
        return make_in_order(order.size(), units_at_once(), look_at_one, [&](size_t i, Unit unit) -> Status {
            RAYPAGER_TRY(check_stop());
            RAYPAGER_TRY(unit.status);
            CloudCell& cell = cells.cells()[order[i]];
            cell.spacing = unit.spacing;
            if (!unit.done) return {};
            result_.merged += unit.merged;
            issues_.add(unit.issues);
            RAYPAGER_TRY(hand_on(unit.spheres, unit.bounds, left, ranks));
            points.discard(cell.begin, cell.end);
            points_done_ += cell.end - cell.begin;
            report(looking, numbering, share(points_done_, count_));
            return {};
        });
    }

    // What is left of a cell: to be numbered once all is known that is, or at once.
    Status hand_on(std::span<SphereRecord> spheres, const Box& bounds, BucketWriter& left, Ranks& ranks) {
        if (keeps_all()) {
            result_.spheres += spheres.size();
            return stream_.take(spheres, bounds);
        }
        for (const SphereRecord& record : spheres) ranks.keep(record.id);
        return left.add(sphere_records, std::as_bytes(spheres));
    }

    struct UnitPoints {
        UnwrittenVector<PointRecord> records;
        UnwrittenVector<CloudPoint> points;  // the same ones
        PointOrder order;
    };

    Status read_unit(const SortedPoints& sorted, const CloudCell& cell, UnitPoints& unit) const {
        unit.records.resize(cell.end - cell.begin);
        RAYPAGER_TRY(sorted.read(cell.begin, unit.records));
        unit.order.grid = sorted.grid;
        const size_t count = unit.records.size();
        unit.points.resize(count);
        unit.order.keys.resize(count);
        unit.order.indices.resize(count);
        for (size_t i = 0; i < count; i++) {
            unit.points[i] = unit.records[i].point;
            unit.order.keys[i] = morton_key(sorted.grid, unit.points[i].position);
            unit.order.indices[i] = static_cast<uint32_t>(i);
        }
        return {};
    }

    // Returns the cell's spacing, 0 if its points do not tell. inherited: spacing of points of which nothing in the cell tells; 0: not known yet.
    float set_radii(const CloudCell& cell, float inherited, UnitPoints& unit) const {
        std::vector<float> spacing(unit.points.size(), 0.0f);
        float of_cell = 0;
        if (by_spacing_ && cell.is_whole) of_cell = estimate_cell_spacing(unit.points, unit.order, cell.level, spacing);
        for (size_t i = 0; i < unit.points.size(); i++)
            unit.points[i].radius = rules_.radius(unit.points[i], spacing[i] > 0 ? spacing[i] : inherited);
        return of_cell;
    }

    // Of a cell that is part of a larger one that is merged, nothing is made but its spacing, nor of one that needs an inherited spacing and has
    // none.
    Unit look_at_unit(const SortedPoints& sorted, const CloudCell& cell, float inherited) const {
        Unit unit;
        UnitPoints held;
        unit.status = read_unit(sorted, cell, held);
        if (!unit.status.ok()) return unit;
        unit.spacing = set_radii(cell, inherited, held);
        if (cell.pixel != RP_NONE || (by_spacing_ && unit.spacing == 0 && inherited == 0)) return unit;
        std::vector<bool> kept(held.points.size(), true);
        unit.spheres.reserve(held.points.size());
        if (rules_.filters()) kept = filter_to_pixels(held.points, held.order, rules_.view(), cell.level);
        for (size_t i = 0; i < held.points.size(); i++) {
            unit.merged += !kept[i];
            if (const auto sphere = kept[i] ? rules_.sphere(held.points[i], unit.issues) : std::nullopt)
                unit.spheres.push_back({*sphere, held.records[i].index});
        }
        unit.bounds = bounds_of(unit.spheres);
        unit.done = true;
        return unit;
    }

    // The cells that are no larger than a pixel, but too large for memory: unit by unit.
    Status merge_large_cells(const SortedPoints& points, CloudCells& cells, BucketWriter& left, Ranks& ranks) {
        std::map<uint32_t, std::vector<const CloudCell*>> units_of;
        for (const CloudCell& cell : cells.cells())
            if (cell.is_unit && cell.pixel != RP_NONE) units_of[cell.pixel].push_back(&cell);
        for (auto& [number, units] : units_of) {
            const CloudCell& whole = cells.cells()[number];
            std::sort(units.begin(), units.end(), [](const CloudCell* a, const CloudCell* b) { return a->begin < b->begin; });
            PixelMerge merge(whole.end - whole.begin, points.grid.size(whole.level));
            for (const bool all_added : {false, true}) {
                for (const CloudCell* unit : units) {
                    RAYPAGER_TRY(check_stop());
                    UnitPoints held;
                    RAYPAGER_TRY(read_unit(points, *unit, held));
                    set_radii(*unit, by_spacing_ && unit->spacing == 0 ? cells.inherited_spacing(*unit) : 0, held);
                    for (size_t i = 0; i < held.points.size(); i++) {
                        if (all_added)
                            merge.compare(held.points[i], held.records[i].index);
                        else
                            merge.add(held.points[i]);
                    }
                }
            }
            points.discard(whole.begin, whole.end);
            report(looking, numbering, share(points_done_ += whole.end - whole.begin, count_));
            result_.merged += whole.end - whole.begin - 1;
            const auto sphere = rules_.sphere(merge.point(), issues_);
            if (!sphere) continue;
            SphereRecord record = {*sphere, merge.number()};
            RAYPAGER_TRY(hand_on(std::span(&record, 1), sphere_bounds(record.sphere), left, ranks));
        }
        return {};
    }

    Status number_what_is_left() {
        const size_t at_once = std::clamp<uint64_t>(stream_.memory.limit / batch_share, size_t{1} << 20, size_t{16} << 20);
        std::vector<SphereRecord> spheres;
        return left_.for_each_piece(at_once, true, [&](RecordKind, std::span<const std::byte> bytes) -> Status {
            RAYPAGER_TRY(check_stop());
            spheres.resize(bytes.size() / sizeof(SphereRecord));
            std::memcpy(spheres.data(), bytes.data(), bytes.size());
            parallel_for(spheres.size(), intake_piece, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; i++) spheres[i].id = static_cast<uint32_t>(ranks_.rank(spheres[i].id));
            });
            result_.spheres += spheres.size();
            RAYPAGER_TRY(stream_.take(spheres, bounds_of(spheres)));
            report(numbering, 1, share(result_.spheres, left_.primitives()));
            return {};
        });
    }

    const Shape& shape_;
    const PointRules& rules_;
    const CloudStream& stream_;
    MeshIssues& issues_;
    StreamedCloud result_;
    Box bounds_;  // of the points that are placed
    std::vector<PointRecord> sample_;
    uint64_t count_ = 0;  // of the points that are placed
    uint64_t points_done_ = 0;
    bool by_spacing_ = false;
    Bucket left_;  // spheres whose ids are indices
    Ranks ranks_{0};
};

}  // namespace

Result<StreamedCloud> stream_cloud(const Shape& shape, const PointRules& rules, const CloudStream& stream, MeshIssues& issues) {
    return Streamer(shape, rules, stream, issues).run();
}

}  // namespace raypager
