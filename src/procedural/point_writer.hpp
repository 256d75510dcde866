// Point clouds written as they come: LAS 1.4 (point format 7) or binary little-endian PLY.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "base/files.hpp"
#include "procedural/make_scene.hpp"
#include "procedural/scan.hpp"

namespace raypager {

// The number of points is not known before the end: the header is written again then. The file appears at commit.
class PointWriter {
public:
    static Result<PointWriter> create(const std::filesystem::path& path, PointFormat format);
    // LAS keeps coordinates to the millimetre, PLY in single precision, without intensity, class and returns.
    Status add(std::span<const ScanPoint> points);
    Status commit();
    uint64_t count() const { return count_; }
    uint64_t bytes() const { return file_.position(); }

private:
    std::vector<std::byte> header() const;

    OutputFile file_;
    PointFormat format_ = PointFormat::las;
    uint64_t count_ = 0;
    std::array<uint64_t, 15> by_return_ = {};         // points by return number
    std::array<int64_t, 3> lower_ = {}, upper_ = {};  // in millimetres
    std::vector<std::byte> buffer_;
};

}  // namespace raypager
