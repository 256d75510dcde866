#include "import/las_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "import/point_readers.hpp"

namespace raypager {
namespace {

constexpr size_t smallest_header = 227;                                            // of LAS 1.0 to 1.2
constexpr size_t las_header_bytes[] = {227, 227, 227, 235, 375};                   // by minor version
constexpr uint16_t record_bytes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};  // by point format
constexpr uint64_t variable_record_bytes = 54, extended_record_bytes = 60;         // headers of (E)VLRs

class HeaderReader {
public:
    explicit HeaderReader(const InputFile& file) : file_(file), bytes_(std::min<uint64_t>(file.size(), las_header_bytes[4])) {}

    Result<LasHeader> read() {
        RAYPAGER_TRY(file_.read(0, bytes_));
        if (bytes_.size() < 4 || std::memcmp(bytes_.data(), "LASF", 4) != 0) return bad("does not start with \"LASF\": not a LAS file");
        if (bytes_.size() < smallest_header) return bad("ends within its header; it is truncated");
        RAYPAGER_TRY(check_version());
        RAYPAGER_TRY(check_variable_records());
        RAYPAGER_TRY(check_point_format());
        RAYPAGER_TRY(check_count());
        check_extended_records();
        RAYPAGER_TRY(check_scale());
        return std::move(header_);
    }

private:
    Status bad(const std::string& what) const { return Status::failed(file_.path().string() + ": " + what); }
    void warn(const std::string& what) { header_.warnings.push_back(file_.path().string() + ": " + what); }
    template <class T>
    T field(size_t at) const {
        return load_las<T>(bytes_.data() + at);
    }

    Status check_version() {
        const auto major = field<uint8_t>(24), minor = field<uint8_t>(25);
        if (major != 1 || minor > 4) return bad(fmt::format("is of LAS version {}.{}; 1.0 to 1.4 can be read", major, minor));
        header_.minor_version = minor;
        own_bytes_ = field<uint16_t>(94);
        if (own_bytes_ < las_header_bytes[minor] || own_bytes_ > file_.size())
            return bad(fmt::format("byte 94: a header of {} bytes, where version 1.{} has {}; the file is damaged or truncated", own_bytes_, minor,
                                   las_header_bytes[minor]));
        header_.points_offset = field<uint32_t>(96);
        if (header_.points_offset < own_bytes_ || header_.points_offset > file_.size())
            return bad(fmt::format("byte 96: points from byte {} on, but the header has {} bytes and the file {}; it is damaged or truncated",
                                   header_.points_offset, own_bytes_, file_.size()));
        return {};
    }

    // Variable length records lie between header and points. Only LASzip's and those of the coordinate system matter here; where the points begin
    // the header says on its own.
    Status check_variable_records() {
        const auto count = field<uint32_t>(100);
        uint64_t at = own_bytes_;
        std::array<std::byte, variable_record_bytes> record;
        for (uint32_t i = 0; i < count; ++i) {
            const uint64_t room = header_.points_offset - at;
            uint64_t length = record.size();
            if (room >= length) {
                RAYPAGER_TRY(file_.read(at, record));
                if (std::memcmp(record.data() + 2, "laszip encoded", 14) == 0) return compressed();
                length += load_las<uint16_t>(record.data() + 20);
            }
            if (room < length) {
                warn(fmt::format("byte {}: variable length record {} of {} would reach into the points; it and those behind it are passed over", at,
                                 i + 1, count));
                return {};
            }
            RAYPAGER_TRY(look_at_record(record.data(), at + record.size(), length - record.size()));
            at += length;
        }
        return {};
    }

    // Whether coordinates are angles: by GeoTIFF's key GTModelType, or by the start of a text (WKT).
    Status look_at_record(const std::byte* record, uint64_t at, uint64_t size) {
        if (std::memcmp(record + 2, "LASF_Projection", 15) != 0) return {};
        const auto id = load_las<uint16_t>(record + 18);
        constexpr uint16_t keys_id = 34735, text_id = 2112, model_type = 1024, geographic = 2;
        std::vector<std::byte> bytes(size);
        RAYPAGER_TRY(file_.read(at, bytes));
        if (id == text_id) header_.geographic = std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).starts_with("GEOG");
        for (size_t key = 8; id == keys_id && key + 8 <= bytes.size(); key += 8)
            if (load_las<uint16_t>(&bytes[key]) == model_type && load_las<uint16_t>(&bytes[key + 2]) == 0)
                header_.geographic = load_las<uint16_t>(&bytes[key + 6]) == geographic;
        return {};
    }

    Status compressed() const {
        return bad("its points are compressed (LAZ), which cannot be read; unpack it, for instance with: laszip -i FILE.laz -o FILE.las");
    }

    Status check_point_format() {
        const auto format = field<uint8_t>(104);
        if ((format & 0xc0) != 0) return compressed();  // LASzip sets the upper bits
        if (format >= std::size(record_bytes)) return bad(fmt::format("byte 104: point format {} is unknown; 0 to 10 can be read", format));
        header_.format = format;
        header_.record_bytes = field<uint16_t>(105);
        if (header_.record_bytes < record_bytes[format])
            return bad(fmt::format("byte 105: points of {} bytes, where format {} has {}; the file is damaged", header_.record_bytes, format,
                                   record_bytes[format]));
        return {};
    }

    // Version 1.4 counts in 64 bits, and repeats the count in the old place where it fits, or writes 0 or all ones there; some of its writers
    // fill in the old place only.
    Status check_count() {
        constexpr uint64_t all_ones = 0xffffffffu;
        const uint64_t old = field<uint32_t>(107), wide = header_.minor_version == 4 ? field<uint64_t>(247) : 0;
        const uint64_t there = (file_.size() - header_.points_offset) / header_.record_bytes;
        const bool old_counts = old != 0 && old != all_ones;
        if (wide != 0 && old_counts && old != wide) return choose_count(old, wide, there);
        header_.count = wide != 0 ? wide : old;
        if (const bool no_count = header_.count == 0 || header_.count == all_ones || header_.count == ~uint64_t{0};
            no_count && header_.count != there)
            return count_by_size();
        if (header_.count > there)
            return bad(fmt::format("the header promises {} points of {} bytes, but only {} are there; the file is truncated or damaged",
                                   header_.count, header_.record_bytes, there));
        return header_.count > 0 ? Status() : bad("has no points");
    }

    // How many points lie between where they begin and the extended records or the end of the file; nothing if that is not a whole number.
    std::optional<uint64_t> count_that_fits() const {
        uint64_t end = file_.size();
        if (header_.minor_version == 4 && field<uint32_t>(243) > 0) {
            const auto start = field<uint64_t>(235);
            if (start > header_.points_offset && start < end) end = start;
        }
        const uint64_t bytes = end - header_.points_offset;
        return bytes % header_.record_bytes == 0 ? std::optional(bytes / header_.record_bytes) : std::nullopt;
    }

    Status choose_count(uint64_t old, uint64_t wide, uint64_t there) {
        const auto fitting = count_that_fits();
        const bool old_right = fitting == old, wide_right = fitting == wide;
        if (old_right || wide_right)
            header_.count = old_right ? old : wide;
        else if ((old <= there) != (wide <= there))
            header_.count = old <= there ? old : wide;
        else
            return bad(fmt::format("says in byte 107 that there are {} points and in byte 247 that there are {}; the file is damaged", old, wide));
        warn(fmt::format("says in byte 107 that there are {} points and in byte 247 that there are {}; its size bears out {}", old, wide,
                         header_.count));
        return {};
    }

    // The header says 0, or what stands for "look elsewhere".
    Status count_by_size() {
        const auto fitting = count_that_fits();
        if (fitting == uint64_t{0} || (!fitting && header_.count == 0)) return bad("has no points");
        if (!fitting)
            return bad(fmt::format("the header promises {} points of {} bytes, and the file's size is that of no number of points; it is damaged",
                                   header_.count, header_.record_bytes));
        warn(fmt::format("byte 107: a count of {} points; its size says {}, which are read", header_.count, *fitting));
        header_.count = *fitting;
        return {};
    }

    // Extended variable length records come after the points. Nothing in them is needed.
    void check_extended_records() {
        if (header_.minor_version < 4) return;
        const uint64_t start = field<uint64_t>(235), count = field<uint32_t>(243);
        if (count == 0) return;
        const uint64_t points_end = header_.points_offset + header_.count * header_.record_bytes;
        if (start < points_end || start > file_.size() || (file_.size() - start) / extended_record_bytes < count)
            warn(fmt::format("byte 235: {} extended records from byte {} on do not fit between the points and byte {}; they are passed over", count,
                             start, file_.size()));
    }

    Status check_scale() {
        for (size_t a = 0; a < 3; ++a) {
            const double scale = header_.scale[a] = field<double>(131 + 8 * a), offset = header_.offset[a] = field<double>(155 + 8 * a);
            const double reach = std::abs(offset) + 0x1p31 * scale;
            if (!(scale > 0) || !std::isfinite(scale))
                return bad(fmt::format("byte {}: a coordinate scale of {:g}; the file is damaged", 131 + 8 * a, scale));
            if (!(reach <= largest_file_coordinate))
                return bad(fmt::format("byte {}: scale {:g} and offset {:g} make coordinates beyond {:g}; the file is damaged", 131 + 8 * a, scale,
                                       offset, largest_file_coordinate));
        }
        return {};
    }

    const InputFile& file_;
    std::vector<std::byte> bytes_;
    uint64_t own_bytes_ = 0;
    LasHeader header_;
};

}  // namespace

Result<LasHeader> read_las_header(const InputFile& file) { return HeaderReader(file).read(); }

}  // namespace raypager
