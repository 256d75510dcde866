#include "procedural/point_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/check.hpp"

namespace raypager {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are stored as they lie in memory");

constexpr size_t las_header_bytes = 375, las_point_bytes = 36, ply_point_bytes = 15;
constexpr double millimetre = 0.001;
constexpr uint16_t wkt_coordinate_system = 1 << 4;  // global encoding: LAS 1.4 demands it with point formats from 6 on

template <class T>
void put(std::byte* at, const T& value) {
    std::memcpy(at, &value, sizeof(T));
}

std::array<int64_t, 3> in_millimetres(const ScanPoint& p) {
    const auto round = [](double x) { return static_cast<int64_t>(std::floor(x * 1000 + 0.5)); };
    return {round(p.x), round(p.y), round(p.z)};
}

// LAS 1.4 R15, table 14.
void put_las(std::byte* at, const ScanPoint& p, const std::array<int64_t, 3>& position) {
    for (size_t a = 0; a < 3; ++a) put(at + 4 * a, static_cast<int32_t>(position[a]));
    put(at + 12, p.intensity);
    put(at + 14, static_cast<uint8_t>(p.return_number | p.return_count << 4));
    put(at + 15, uint8_t{0});
    put(at + 16, static_cast<uint8_t>(p.kind));
    put(at + 17, uint8_t{0});
    put(at + 18, p.angle);
    put(at + 20, p.flight_line);
    put(at + 22, p.time);
    for (size_t c = 0; c < 3; ++c) put(at + 30 + 2 * c, static_cast<uint16_t>(p.color[c] * 257));
}

void put_ply(std::byte* at, const ScanPoint& p) {
    put(at, float3({p.x, p.y, p.z}));
    put(at + 12, p.color);
}

// LAS 1.4 R15, table 3.
std::vector<std::byte> las_header(uint64_t count, const std::array<uint64_t, 15>& by_return, const std::array<int64_t, 3>& lower,
                                  const std::array<int64_t, 3>& upper) {
    std::vector<std::byte> header(las_header_bytes);
    const auto at = [&](size_t offset) { return header.data() + offset; };
    std::memcpy(at(0), "LASF", 4);
    put(at(6), wkt_coordinate_system);
    put(at(24), std::array<uint8_t, 2>{1, 4});
    std::memcpy(at(26), "OTHER", 5);
    std::memcpy(at(58), "raypager make-scene", 19);
    put(at(94), static_cast<uint16_t>(las_header_bytes));
    put(at(96), static_cast<uint32_t>(las_header_bytes));
    put(at(104), uint8_t{7});
    put(at(105), static_cast<uint16_t>(las_point_bytes));
    for (size_t a = 0; a < 3; ++a) {
        put(at(131 + 8 * a), millimetre);
        put(at(179 + 16 * a), static_cast<double>(upper[a]) * millimetre);
        put(at(187 + 16 * a), static_cast<double>(lower[a]) * millimetre);
    }
    put(at(247), count);
    for (size_t r = 0; r < by_return.size(); ++r) put(at(255 + 8 * r), by_return[r]);
    return header;
}

// Blanks after the count keep its room.
std::string ply_header(uint64_t count) {
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment raypager make-scene\nelement vertex {:<20}\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        count);
}

}  // namespace

std::vector<std::byte> PointWriter::header() const {
    if (format_ == PointFormat::las) return las_header(count_, by_return_, lower_, upper_);
    const std::string text = ply_header(count_);
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

Result<PointWriter> PointWriter::create(const std::filesystem::path& path, PointFormat format) {
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    PointWriter writer;
    writer.file_ = std::move(*file);
    writer.format_ = format;
    writer.lower_.fill(INT64_MAX);
    writer.upper_.fill(INT64_MIN);
    RAYPAGER_TRY(writer.file_.write(writer.header()));
    return writer;
}

Status PointWriter::add(std::span<const ScanPoint> points) {
    const size_t stride = format_ == PointFormat::las ? las_point_bytes : ply_point_bytes;
    buffer_.resize(points.size() * stride);
    std::byte* to = buffer_.data();
    for (const ScanPoint& p : points) {
        const auto position = in_millimetres(p);
        for (size_t a = 0; a < 3; ++a) {
            lower_[a] = std::min(lower_[a], position[a]);
            upper_[a] = std::max(upper_[a], position[a]);
        }
        RAYPAGER_CHECK(p.return_number >= 1 && p.return_number <= by_return_.size());
        ++by_return_[p.return_number - 1];
        if (format_ == PointFormat::las)
            put_las(to, p, position);
        else
            put_ply(to, p);
        to += stride;
    }
    count_ += points.size();
    return file_.write(buffer_);
}

Status PointWriter::commit() {
    RAYPAGER_TRY(file_.write_at(0, header()));
    return file_.commit();
}

}  // namespace raypager
