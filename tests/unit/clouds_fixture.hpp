// What tests of the readers of point clouds share.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "import/cloud_file.hpp"
#include "support/temporary_folder.hpp"
#include "unit/cloud_files.hpp"

namespace raypager::clouds_test {

using support::TemporaryFolder;
using test::bytes_of;
using test::LasFile;
using test::make_las;
using test::some_points;
using test::to_las;
using test::to_point_ply;

constexpr uint32_t rgb(uint32_t red, uint32_t green, uint32_t blue) { return red | green << 8 | blue << 16; }

class ImportClouds : public testing::Test {
protected:
    struct Points {
        std::vector<CloudPoint> points;
        MeshIssues issues;
        uint64_t count = 0;
        bool has_color = false;
        std::array<double, 3> origin;
    };
    Result<Points> try_read(const std::string& name, const std::string& content) {
        const auto cloud = CloudFile::open(folder.write(name, content));
        if (!cloud) return cloud.status();
        Points read{{}, {}, (*cloud)->count(), (*cloud)->has_color(), (*cloud)->origin()};
        RAYPAGER_TRY((*cloud)->stream(
            [&](std::span<const CloudPoint> points) {
                read.points.insert(read.points.end(), points.begin(), points.end());
                return Status();
            },
            read.issues));
        EXPECT_LE(read.points.size() + read.issues.not_finite, read.count);
        return read;
    }
    Points read(const std::string& name, const std::string& content) {
        auto points = try_read(name, content);
        EXPECT_TRUE(points.ok()) << points.status().message();
        return points.ok() ? std::move(*points) : Points();
    }
    void expect_error(const std::string& name, const std::string& content, const std::string& what) {
        const auto points = try_read(name, content);
        ASSERT_FALSE(points.ok()) << name << ": expected " << what;
        EXPECT_NE(points.status().message().find(what), std::string::npos) << points.status().message();
        EXPECT_EQ(points.status().message().find((folder / name).string()), 0u) << points.status().message();
    }
    TemporaryFolder folder;
};

inline void expect_position(const CloudPoint& point, double x, double y, double z) {
    EXPECT_EQ(point.position.x, static_cast<float>(x));
    EXPECT_EQ(point.position.y, static_cast<float>(y));
    EXPECT_EQ(point.position.z, static_cast<float>(z));
}

}  // namespace raypager::clouds_test
