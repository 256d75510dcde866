#include "import/text_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/line_reader.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

constexpr size_t max_lines = 1000, max_bytes = size_t{1} << 20;  // that are looked at from the start
constexpr uint64_t spread_parts = 16;                            // of the file, from each of which some lines more are looked at
constexpr size_t spread_lines = 32;
constexpr size_t max_comments = 100, longest_names = 4096;

struct Line {
    std::string text;
    uint64_t number;
};

using Words = std::array<std::string_view, max_columns>;

class LayoutFinder {
public:
    LayoutFinder(const InputFile& file, const PointColumns& named) : file_(file), named_(named) {}

    Result<TextLayout> run() {
        RAYPAGER_TRY(read_start());
        DialectFinder dialect;
        for (const Line& line : lines_) dialect.add(line.text);
        layout_.dialect = dialect.found();
        RAYPAGER_TRY(find_first_point());
        RAYPAGER_TRY(name_columns());
        RAYPAGER_TRY(check_first_point());
        return std::move(layout_);
    }

private:
    // The first lines: comments before the points, and all others.
    Status read_start() {
        LineReader reader(file_);
        for (size_t bytes = 0; lines_.size() < max_lines && bytes < max_bytes;) {
            std::string_view line;
            bool end = false;
            RAYPAGER_TRY(reader.next(line, end));
            if (end) break;
            bytes += line.size();
            if (!is_point_comment(line))
                lines_.push_back({std::string(line), reader.line()});
            else if (lines_.size() < 3 && comments_.size() < max_comments)
                comments_.push_back({std::string(line), reader.line()});
        }
        return lines_.empty() ? no_points() : Status();
    }

    Status no_points() const { return Status::failed(file_.path().string() + ": has no points; lines of x y z are expected"); }
    Status bad(const Line& line, const std::string& what) const {
        return Status::failed(fmt::format("{}:{}: {}", file_.path().string(), line.number, what));
    }
    size_t split(std::string_view line, Words& words) const { return split_fields(line, layout_.dialect, words); }
    bool is_number(std::string_view word) const { return parse_field(word, layout_.dialect).has_value(); }
    size_t numbers(const Words& words, size_t count) const {
        return static_cast<size_t>(std::count_if(words.begin(), words.begin() + std::min<ptrdiff_t>(static_cast<ptrdiff_t>(count), std::ssize(words)),
                                                 [&](std::string_view word) { return is_number(word); }));
    }

    // Sets count, and header_line where a line of words comes before the first point. Lines of one number count points.
    Status find_first_point() {
        for (; first_ < lines_.size(); ++first_) {
            const Line& line = lines_[first_];
            Words words;
            const size_t count = split(line.text, words);
            const bool starts_with_word = !is_number(words[0]);
            if (layout_.header_line == 0 && starts_with_word && (named_.empty() || numbers(words, count) < 3)) {
                layout_.header_line = line.number;
                header_ = first_;
                continue;
            }
            if (count == 1) continue;
            if (count < 3) return bad(line, "too few numbers; a point has three coordinates");
            layout_.count = layout_.least = count;
            return check_header();
        }
        return no_points();
    }

    // What looks like a point but for a word in it is a damaged one.
    Status check_header() const {
        if (!header_) return {};
        Words words;
        const size_t count = split(lines_[*header_].text, words);
        if (count != layout_.count || 2 * numbers(words, count) < count) return {};
        const auto word = std::find_if(words.begin(), words.end(), [&](std::string_view w) { return !is_number(w); });
        return bad(lines_[*header_], fmt::format("\"{}\" is no number", clipped(*word)));
    }

    Status name_columns() {
        if (!named_.empty()) {
            if (named_.size() > layout_.count)
                return bad(lines_[first_], fmt::format("{} numbers, while {} columns are named for them", layout_.count, named_.size()));
            take(named_);
            find_text_tail();
            return {};
        }
        if (header_) {
            if (names_in(lines_[*header_].text, true)) return {};
            warn_of_header();
        }
        for (size_t i = comments_.size(); i-- > 0;)
            if (names_in(comments_[i].text, false)) return {};
        guess();
        return {};
    }

    // Whether the words of a line name the columns, whatever stands between them. In a comment, which may be anything, all words must be known
    // unless something other than blanks separates them.
    bool names_in(std::string_view text, bool header) {
        if (text.size() > longest_names) return false;
        text.remove_prefix(std::min(text.find_first_not_of("#/; \t%"), text.size()));
        if (const size_t colon = text.find(':'); !header && colon != std::string_view::npos && !find_point_column(text.substr(0, colon)))
            text.remove_prefix(colon + 1);
        for (const char separator : {';', '\t', ',', ' '}) {
            const auto names = split_names(text, separator);
            if (names.size() != layout_.count) continue;
            PointColumns columns;
            bool all_known = true, geographic = false;
            for (const std::string& name : names) {
                const auto column = find_point_column(name);
                all_known = all_known && column;
                geographic = geographic || is_geographic_name(name);
                columns.push_back(column.value_or(PointColumn::skip));
            }
            if (!have_position(columns) || (!header && separator == ' ' && !all_known)) continue;
            take(columns);
            layout_.geographic = geographic;
            find_text_tail();
            return true;
        }
        return false;
    }

    static std::vector<std::string> split_names(std::string_view text, char separator) {
        std::vector<std::string> names;
        const auto add = [&](std::string_view name) {
            const size_t begin = name.find_first_not_of(" \t\"'"), end = name.find_last_not_of(" \t\"'");
            names.emplace_back(begin == std::string_view::npos ? std::string_view() : name.substr(begin, end - begin + 1));
        };
        if (separator == ' ') {
            for (const std::string_view word : split_words(text)) add(word);
            return names;
        }
        for (size_t at = 0; at <= text.size();) {
            const size_t end = std::min(text.find(separator, at), text.size());
            if (end < text.size() || text.find_first_not_of(" \t", at) != std::string_view::npos) add(text.substr(at, end - at));
            at = end + 1;
        }
        return names;
    }

    // The first column of each name counts.
    void take(const PointColumns& columns) {
        const auto find = [&](PointColumn column) -> std::optional<size_t> {
            const auto at = std::find(columns.begin(), columns.end(), column);
            return at == columns.end() || at - columns.begin() >= std::ssize(Words()) ? std::nullopt
                                                                                      : std::optional(static_cast<size_t>(at - columns.begin()));
        };
        const auto x = find(PointColumn::x), y = find(PointColumn::y), z = find(PointColumn::z);
        if (x && y && z) layout_.position = {*x, *y, *z};
        const auto r = find(PointColumn::red), g = find(PointColumn::green), b = find(PointColumn::blue);
        if (r && g && b) layout_.color = {*r, *g, *b};
        layout_.intensity = find(PointColumn::intensity);
        if (!layout_.intensity) layout_.classification = find(PointColumn::classification);
        layout_.radius = find(PointColumn::radius);
    }

    void warn_of_header() {
        const Line& line = lines_[*header_];
        if (line.text.size() > longest_names) return;
        size_t coordinates = 0;
        for (const char separator : {';', '\t', ',', ' '}) {
            size_t found = 0;
            for (const std::string& name : split_names(line.text, separator)) {
                const auto column = find_point_column(name);
                found += column == PointColumn::x || column == PointColumn::y || column == PointColumn::z;
            }
            coordinates = std::max(coordinates, found);
        }
        if (coordinates < 2) return;
        layout_.warnings.push_back(
            fmt::format("{}:{}: the names in this line are not those of the {} columns below, and are not used; --columns says "
                        "which is which",
                        file_.path().string(), line.number, layout_.count));
    }

    void guess() {
        const auto rows = look_at_rows();
        const ColumnGuess guess = guess_columns(rows, layout_.count);
        take(guess.columns);
        layout_.color_type = guess.color_type;
        find_text_tail();
        if (guess.sure) return;
        layout_.warnings.push_back(fmt::format("{}: nothing names its {} columns; they are read as {}, which --columns can change",
                                               file_.path().string(), layout_.count, point_column_list(guess.columns)));
    }

    std::vector<ColumnRow> look_at_rows() const {
        std::vector<ColumnRow> rows;
        for (size_t i = first_; i < lines_.size(); ++i)
            if (!add_row(lines_[i].text, rows)) break;  // read() will say where and why
        for (uint64_t part = 1; part < spread_parts; ++part) {
            LineReader reader(file_, file_.size() * part / spread_parts);
            std::string_view line;
            bool end = false;
            for (size_t i = 0; i <= spread_lines && reader.next(line, end).ok() && !end; ++i)
                if (i > 0) (void)add_row(line, rows);  // the first is the rest of one
        }
        return rows;
    }

    // False if the line is no point of these columns.
    bool add_row(std::string_view line, std::vector<ColumnRow>& rows) const {
        Words words;
        const size_t count = is_point_comment(line) ? 1 : split(line, words);
        if (count == 1) return true;
        const size_t known = std::min(layout_.count, words.size());
        const bool text_behind = count != layout_.count && count >= 3 && known > 3;
        if (count != layout_.count && !text_behind) return false;
        ColumnRow& row = rows.emplace_back();
        row.fill(NAN);
        for (size_t c = 0; c < std::min(known, count); ++c) row[c] = parse_field(words[c], layout_.dialect).value_or(NAN);
        return true;
    }

    // Words at the end of the first point that nobody needs and that are no numbers: of such there may be any number.
    void find_text_tail() {
        Words words;
        split(lines_[first_].text, words);
        size_t needed = std::max({layout_.position[0], layout_.position[1], layout_.position[2]});
        if (layout_.color) needed = std::max({needed, (*layout_.color)[0], (*layout_.color)[1], (*layout_.color)[2]});
        for (const auto& column : {layout_.intensity, layout_.classification, layout_.radius}) needed = std::max(needed, column.value_or(0));
        while (layout_.least > needed + 1 && layout_.least <= words.size() && !is_number(words[layout_.least - 1])) --layout_.least;
    }

    Status check_first_point() const {
        Words words;
        split(lines_[first_].text, words);
        for (const size_t column : layout_.position)
            if (!is_number(words[column])) return bad(lines_[first_], fmt::format("\"{}\" is no number", clipped(words[column])));
        return {};
    }

    const InputFile& file_;
    const PointColumns& named_;
    std::vector<Line> lines_, comments_;
    std::optional<size_t> header_;
    size_t first_ = 0;  // of lines_: the first point
    TextLayout layout_;
};

}  // namespace

bool is_point_comment(std::string_view line) {
    const size_t start = line.find_first_not_of(" \t");
    if (start == std::string_view::npos) return true;
    line.remove_prefix(start);
    return line[0] == '#' || line[0] == ';' || line[0] == '%' || line.starts_with("//");
}

Result<TextLayout> find_text_layout(const InputFile& file, const PointColumns& named) { return LayoutFinder(file, named).run(); }

}  // namespace raypager
