// Point files for tests, byte by byte as the formats' documents have it; shares nothing with the readers.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "unit/import_files.hpp"

namespace raypager::test {

struct LasPoint {
    std::array<int32_t, 3> position = {0, 0, 0};  // as stored
    uint16_t intensity = 0;
    uint8_t classification = 1;
    bool withheld = false;
    std::array<uint16_t, 3> color = {0, 0, 0};
};

struct LasFile {
    uint8_t minor = 2, format = 0;
    std::array<double, 3> scale = {0.01, 0.01, 0.01}, offset = {0, 0, 0};
    std::vector<LasPoint> points;
    uint16_t extra_bytes = 0;      // behind each point
    std::string variable_records;  // between header and points
    uint32_t variable_record_count = 0;
    std::string extended_records;  // behind the points; as one record
    bool legacy_count = true, wide_count = true;
};

inline std::string las_variable_record(const std::string& user, uint16_t id, const std::string& payload) {
    std::string padded = user;
    padded.resize(16, '\0');
    return bytes_of(uint16_t{0}) + padded + bytes_of(id) + bytes_of(static_cast<uint16_t>(payload.size())) + std::string(32, '\0') + payload;
}

inline void put(std::string& bytes, size_t at, const std::string& value) { bytes.replace(at, value.size(), value); }

inline std::string las_record(const LasFile& file, const LasPoint& p) {
    static constexpr size_t lengths[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    static constexpr size_t color_at[] = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};
    std::string record(lengths[file.format] + file.extra_bytes, '\x5a');  // not zeros: what is not read must not matter
    for (size_t a = 0; a < 3; ++a) put(record, 4 * a, bytes_of(p.position[a]));
    put(record, 12, bytes_of(p.intensity));
    if (file.format < 6) {
        put(record, 15, bytes_of(static_cast<uint8_t>(p.classification | (p.withheld ? 128 : 0))));
    } else {
        put(record, 15, bytes_of(static_cast<uint8_t>(p.withheld ? 4 : 0)));
        put(record, 16, bytes_of(p.classification));
    }
    for (size_t c = 0; c < 3 && color_at[file.format]; ++c) put(record, color_at[file.format] + 2 * c, bytes_of(p.color[c]));
    return record;
}

inline std::string to_las(const LasFile& file) {
    static constexpr uint16_t header_bytes[] = {227, 227, 227, 235, 375};
    const uint16_t length = header_bytes[file.minor];
    std::string points;
    for (const LasPoint& p : file.points) points += las_record(file, p);
    const auto count = static_cast<uint32_t>(file.points.size());
    const auto points_offset = static_cast<uint32_t>(length + file.variable_records.size());
    std::string header(length, '\0');
    put(header, 0, "LASF");
    put(header, 24, bytes_of(uint8_t{1}) + bytes_of(file.minor));
    put(header, 94, bytes_of(length) + bytes_of(points_offset) + bytes_of(file.variable_record_count));
    put(header, 104, bytes_of(file.format) + bytes_of(static_cast<uint16_t>(las_record(file, {}).size())));
    put(header, 107, bytes_of(file.legacy_count ? count : 0));
    for (size_t a = 0; a < 3; ++a) {
        put(header, 131 + 8 * a, bytes_of(file.scale[a]));
        put(header, 155 + 8 * a, bytes_of(file.offset[a]));
    }
    if (file.minor == 4) {
        const bool extended = !file.extended_records.empty();
        put(header, 235, bytes_of(extended ? uint64_t{points_offset + points.size()} : uint64_t{0}) + bytes_of(uint32_t{extended}));
        put(header, 247, bytes_of(file.wide_count ? uint64_t{count} : uint64_t{0}));
    }
    return header + file.variable_records + points + file.extended_records;
}

// A few points in a box, with colours, in a format that has them.
inline LasFile make_las(uint8_t minor, uint8_t format, size_t count = 40) {
    LasFile file;
    file.minor = minor;
    file.format = format;
    for (size_t i = 0; i < count; ++i) {
        const auto n = static_cast<int32_t>(i);
        file.points.push_back({{100 * n, 7 * n * n % 1000, -30 * n},
                               static_cast<uint16_t>(50 * i),
                               static_cast<uint8_t>(2 + i % 4),
                               false,
                               {static_cast<uint16_t>(1000 * i), static_cast<uint16_t>(65535 - 1000 * i), 32768}});
    }
    return file;
}

// Points with colours of one byte; text, or binary in either order.
inline std::string to_point_ply(const std::vector<Float3>& points, const std::string& encoding) {
    std::string text = "ply\nformat " + encoding + " 1.0\nelement vertex " + std::to_string(points.size());
    text += "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for (size_t i = 0; i < points.size(); ++i) {
        const Float3& p = points[i];
        const auto shade = static_cast<uint8_t>(i % 256);
        if (encoding == "ascii") {
            text += to_text(p) + " " + std::to_string(shade) + " 128 255\n";
            continue;
        }
        for (const float c : {p.x, p.y, p.z}) text += bytes_of(c, encoding == "binary_big_endian");
        text += bytes_of(shade) + "\x80\xff";
    }
    return text;
}

inline std::vector<Float3> some_points(size_t count = 40) {
    std::vector<Float3> points;
    for (size_t i = 0; i < count; ++i) {
        const auto n = static_cast<float>(i);
        points.push_back({0.25f * n, 1 - 0.5f * n, n * n / 64});
    }
    return points;
}

}  // namespace raypager::test
