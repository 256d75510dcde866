#include "import/guess_columns.hpp"

#include <algorithm>
#include <cmath>

namespace raypager {
namespace {

constexpr size_t min_rows = 8;           // that a correlation is worth something with
constexpr double clear_advantage = 0.5;  // of the sums of three correlations
constexpr double return_like = 8, class_like = 15, brightest_at_least = 16;

struct Column {
    bool number = true, whole = true, normal = false;
    double low = INFINITY, high = -INFINITY;
    bool constant() const { return low == high; }
    // As return numbers are. A column of one number is a colour's rather, unless it says "one of one".
    bool counts() const { return whole && low >= 0 && high >= 1 && high <= return_like && (!constant() || high <= 2); }
    bool classes() const { return whole && low >= 0 && high > return_like && high <= class_like && !constant(); }
};

enum class Range { none, bytes, words, fractions };

class Guess {
public:
    Guess(std::span<const ColumnRow> rows, size_t count) : rows_(rows), known_(std::min(count, max_columns)), count_(count) {
        for (size_t c = 0; c < known_; ++c) survey(c);
        for (size_t c = 3; c + 2 < known_; ++c) mark_normals(c);
    }

    ColumnGuess run() {
        guess_.columns.assign(known_, PointColumn::skip);
        for (size_t a = 0; a < 3; ++a) guess_.columns[a] = static_cast<PointColumn>(static_cast<size_t>(PointColumn::x) + a);
        const auto color = find_color();
        if (color)
            for (size_t c = 0; c < 3; ++c) guess_.columns[*color + c] = static_cast<PointColumn>(static_cast<size_t>(PointColumn::red) + c);
        // Of six columns and more, three may be anything: only what can be an intensity is taken for one.
        const bool room = known_ > 3 && columns_[3].number && !columns_[3].normal && guess_.columns[3] == PointColumn::skip;
        if (room && (color || count_ <= 5 || columns_[3].low >= 0)) guess_.columns[3] = PointColumn::intensity;
        if (!color)
            guess_.sure = std::none_of(columns_.begin(), columns_.begin() + static_cast<ptrdiff_t>(known_), [&](const Column& column) {
                const auto c = static_cast<size_t>(&column - columns_.data());
                return column.number && !column.normal && guess_.columns[c] == PointColumn::skip;
            });
        return guess_;
    }

private:
    void survey(size_t c) {
        Column& column = columns_[c];
        for (const ColumnRow& row : rows_) {
            const double x = row[c];
            column.number = column.number && !std::isnan(x);
            column.whole = column.whole && x == std::floor(x);
            column.low = std::min(column.low, x);
            column.high = std::max(column.high, x);
        }
    }

    void mark_normals(size_t c) {
        for (const ColumnRow& row : rows_) {
            const double length = std::hypot(row[c], row[c + 1], row[c + 2]);
            if (!(std::abs(length - 1) < 1e-2) && length != 0) return;
        }
        const bool any = columns_[c].high != columns_[c].low || columns_[c].high != 0 || columns_[c + 1].high != 0 || columns_[c + 2].high != 0;
        for (size_t i = c; any && i < c + 3; ++i) columns_[i].normal = true;
    }

    Range range_of(size_t c) const {
        const std::span<const Column> three(&columns_[c], 3);
        const auto all = [&](const auto& holds) { return std::all_of(three.begin(), three.end(), holds); };
        double high = 0;
        for (const Column& column : three) high = std::max(high, column.high);
        if (!all([](const Column& column) { return column.number && !column.normal && column.low >= 0; })) return Range::none;
        if (all([](const Column& column) { return column.whole; })) {
            if (std::any_of(three.begin(), three.end(), [](const Column& column) { return column.counts(); }) || classes(c) > 1) return Range::none;
            if (high <= 255) return high >= brightest_at_least ? Range::bytes : Range::none;
            return high <= 65535 && all([](const Column& column) { return column.high > 255 || column.high == 0; }) ? Range::words : Range::none;
        }
        return high <= 1 ? Range::fractions : Range::none;
    }

    size_t classes(size_t c) const {
        return static_cast<size_t>(std::count_if(&columns_[c], &columns_[c] + 3, [](const Column& column) { return column.classes(); }));
    }

    std::optional<size_t> find_color() {
        for (const Range range : {Range::bytes, Range::words, Range::fractions}) {
            std::vector<size_t> found;
            for (size_t c = 3; c + 2 < known_; ++c)
                if (range_of(c) == range) found.push_back(c);
            if (found.empty()) continue;
            guess_.color_type = range == Range::bytes ? ColorType::byte : range == Range::words ? ColorType::word : ColorType::number;
            return choose(found);
        }
        return std::nullopt;
    }

    // Of several sets, those without what may be classes; then by how much their columns have in common.
    size_t choose(std::vector<size_t> found) {
        const size_t fewest = classes(*std::min_element(found.begin(), found.end(), [&](size_t a, size_t b) { return classes(a) < classes(b); }));
        std::erase_if(found, [&](size_t c) { return classes(c) > fewest; });
        if (found.size() == 1) return found[0];
        // One number for all points is an alpha, or an intensity that says nothing.
        if (found.size() == 2 && found[1] == found[0] + 1) {
            const bool first = columns_[found[0]].constant(), last = columns_[found[1] + 2].constant();
            if (first != last) return first ? found[1] : found[0];
        }
        std::stable_sort(found.begin(), found.end(), [&](size_t a, size_t b) { return together(a) > together(b); });
        if (together(found[0]) - together(found[1]) > clear_advantage) return found[0];
        guess_.sure = false;
        const bool intensity_first = count_ == 7 && std::find(found.begin(), found.end(), size_t{4}) != found.end();
        return intensity_first ? 4 : *std::min_element(found.begin(), found.end());
    }

    double together(size_t c) const { return correlation(c, c + 1) + correlation(c, c + 2) + correlation(c + 1, c + 2); }

    // 0 to 1, whatever the sign; 0 where it cannot be told.
    double correlation(size_t a, size_t b) const {
        if (rows_.size() < min_rows) return 0;
        double mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
        const auto n = static_cast<double>(rows_.size());
        for (const ColumnRow& row : rows_) mean_a += row[a] / n, mean_b += row[b] / n;
        for (const ColumnRow& row : rows_) {
            const double da = row[a] - mean_a, db = row[b] - mean_b;
            aa += da * da, bb += db * db, ab += da * db;
        }
        return aa > 0 && bb > 0 ? std::abs(ab) / std::sqrt(aa * bb) : 0;
    }

    std::span<const ColumnRow> rows_;
    size_t known_, count_;
    std::array<Column, max_columns> columns_;
    ColumnGuess guess_;
};

}  // namespace

ColumnGuess guess_columns(std::span<const ColumnRow> rows, size_t count) { return Guess(rows, count).run(); }

}  // namespace raypager
