// make_scene points: counts, contents, both formats through the importer, determinism, and what is left when the disk is full.
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "import/cloud_file.hpp"
#include "procedural/city.hpp"
#include "procedural/make_scene.hpp"
#include "procedural/scan.hpp"
#include "raypager/import.hpp"
#include "support/failing_file_system.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

MakeSceneOptions wanted(const std::filesystem::path& folder, uint64_t points, PointFormat format = PointFormat::las, uint64_t seed = 1) {
    MakeSceneOptions options;
    options.kind = "points";
    options.directory = folder;
    options.points = points;
    options.format = format;
    options.seed = seed;
    return options;
}

std::vector<CloudPoint> read_all(const std::filesystem::path& path) {
    const auto cloud = CloudFile::open(path);
    EXPECT_TRUE(cloud.ok()) << cloud.status().message();
    std::vector<CloudPoint> points;
    MeshIssues issues;
    const Status status = (*cloud)->stream(
        [&](std::span<const CloudPoint> piece) {
            points.insert(points.end(), piece.begin(), piece.end());
            return Status();
        },
        issues);
    EXPECT_TRUE(status.ok()) << status.message();
    EXPECT_FALSE(issues.any());
    return points;
}

uint64_t hash_of(const MakeSceneOptions& options) {
    EXPECT_TRUE(make_scene(options).ok());
    return hash64(*read_text(options.directory / (options.format == PointFormat::las ? "points.las" : "points.ply")));
}

template <class T>
T load(const std::string& bytes, size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

TEST(ProceduralPoints, AreAboutAsManyAsAsked) {
    for (const uint64_t count : {1000u, 30'000u, 400'000u}) {
        const support::TemporaryFolder folder;
        const auto made = make_scene(wanted(folder.path(), count));
        ASSERT_TRUE(made.ok()) << made.status().message();
        // A scan of so few lines cannot be divided finely; for larger ones it is what the estimate of returns a pulse is good for.
        const double tolerance = count < 5000 ? 0.1 : 0.02;
        EXPECT_NEAR(static_cast<double>(made->points), static_cast<double>(count), tolerance * static_cast<double>(count));
        EXPECT_EQ(made->triangles, 0u);
        EXPECT_EQ(read_all(folder / "points.las").size(), made->points);
        uint64_t bytes = 0;
        for (const auto& file : folder.files()) bytes += std::filesystem::file_size(file);
        EXPECT_EQ(bytes, made->bytes);
        EXPECT_EQ(folder.files().size(), 2u);
    }
}

TEST(ProceduralPoints, HeaderAndPointsOfLasAgree) {
    const support::TemporaryFolder folder;
    const auto made = make_scene(wanted(folder.path(), 100'000));
    ASSERT_TRUE(made.ok());
    const std::string file = *read_text(folder / "points.las");
    EXPECT_EQ(load<uint32_t>(file, 107), 0u) << "the count in 32 bits is not for point formats from 6 on";
    EXPECT_EQ(load<uint64_t>(file, 247), made->points);
    EXPECT_EQ(file.size(), 375 + 36 * made->points);
    std::map<int, uint64_t> by_return, by_class;
    double lower[3] = {1e9, 1e9, 1e9}, upper[3] = {-1e9, -1e9, -1e9}, last_time = -1;
    for (uint64_t i = 0; i < made->points; ++i) {
        const size_t at = 375 + 36 * i;
        const int returns = load<uint8_t>(file, at + 14);
        ++by_return[returns & 15];
        ++by_class[load<uint8_t>(file, at + 16)];
        EXPECT_LE(returns & 15, returns >> 4);
        for (size_t a = 0; a < 3; ++a) {
            const double x = load<int32_t>(file, at + 4 * a) * 0.001;
            lower[a] = std::min(lower[a], x), upper[a] = std::max(upper[a], x);
        }
        const double time = load<double>(file, at + 22);
        EXPECT_GE(time, last_time);
        last_time = time;
    }
    uint64_t total = 0;
    for (size_t r = 0; r < 15; ++r) {
        EXPECT_EQ(load<uint64_t>(file, 255 + 8 * r), by_return[static_cast<int>(r) + 1]);
        total += load<uint64_t>(file, 255 + 8 * r);
    }
    EXPECT_EQ(total, made->points);
    for (size_t a = 0; a < 3; ++a) {
        EXPECT_DOUBLE_EQ(load<double>(file, 179 + 16 * a), upper[a]);
        EXPECT_DOUBLE_EQ(load<double>(file, 187 + 16 * a), lower[a]);
        EXPECT_GT(upper[a] - lower[a], a < 2 ? 100 : 10) << "a city of some extent";
    }
    for (const PointClass kind : {ground, high_vegetation, building, road}) EXPECT_GT(by_class[kind], made->points / 50) << int{kind};
    EXPECT_GT(by_return[2], made->points / 200) << "pulses go through leaves";
}

TEST(ProceduralPoints, AreTheSameInBothFormats) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(make_scene(wanted(folder / "las", 20'000)).ok());
    ASSERT_TRUE(make_scene(wanted(folder / "ply", 20'000, PointFormat::ply)).ok());
    const auto las = read_all(folder / "las" / "points.las"), ply = read_all(folder / "ply" / "points.ply");
    ASSERT_EQ(las.size(), ply.size());
    for (size_t i = 0; i < las.size(); ++i) {
        // LAS keeps millimetres.
        ASSERT_NEAR(las[i].position.x, ply[i].position.x, 0.0006);
        ASSERT_NEAR(las[i].position.y, ply[i].position.y, 0.0006);
        ASSERT_NEAR(las[i].position.z, ply[i].position.z, 0.0006);
        ASSERT_EQ(las[i].color, ply[i].color);
    }
    for (const char* kind : {"las", "ply"}) {
        const auto scene = import_scene({folder / kind / "scene.pbrt"});
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        ASSERT_EQ(scene->shapes.size(), 1u);
        ASSERT_TRUE(scene->shapes[0].points);
        EXPECT_TRUE(scene->shapes[0].points->has_color());
        EXPECT_TRUE(scene->warnings.empty()) << scene->warnings[0];
        EXPECT_EQ(scene->lights.size(), 2u);
    }
}

TEST(ProceduralPoints, DependOnTheSeedAndNotOnTheCores) {
    const support::TemporaryFolder folder;
    const uint64_t hash = hash_of(wanted(folder / "a", 150'000));
    EXPECT_NE(hash, hash_of(wanted(folder / "b", 150'000, PointFormat::las, 2)));
    cpu_set_t before, one;
    ASSERT_EQ(::sched_getaffinity(0, sizeof before, &before), 0);
    CPU_ZERO(&one);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
        if (CPU_ISSET(cpu, &before)) {
            CPU_SET(cpu, &one);
            break;
        }
    ASSERT_EQ(::sched_setaffinity(0, sizeof one, &one), 0);
    const uint64_t alone = hash_of(wanted(folder / "c", 150'000));
    ASSERT_EQ(::sched_setaffinity(0, sizeof before, &before), 0);
    EXPECT_EQ(hash, alone);
}

TEST(ProceduralPoints, AFullDiskLeavesNoHalfFiles) {
    for (int64_t nth = 1;; ++nth) {
        const support::TemporaryFolder folder;
        support::FailingFileSystem disk;
        disk.error_number = ENOSPC;
        disk.fail_write_in = nth;
        const auto made = make_scene(wanted(folder.path(), 50'000));
        if (disk.fail_write_in > 0) {
            EXPECT_TRUE(made.ok()) << made.status().message();
            EXPECT_GT(nth, 3) << "points, header, scene";
            break;
        }
        ASSERT_FALSE(made.ok());
        EXPECT_NE(made.status().message().find("No space left"), std::string::npos) << made.status().message();
        for (const auto& file : folder.files()) {
            EXPECT_EQ(file.filename(), "points.las") << "the scene file comes last, and no temporary file stays";
            EXPECT_GT(read_all(file).size(), 1000u);
        }
    }
}

TEST(ProceduralPoints, RefuseWhatCannotBeMade) {
    const support::TemporaryFolder folder;
    EXPECT_EQ(make_scene(wanted(folder.path(), 10)).status().exit_code(), 2);
    EXPECT_EQ(make_scene(wanted(folder.path(), 5'000'000'000)).status().exit_code(), 2);
    MakeSceneOptions options = wanted(folder.path(), 1000);
    options.triangles = 1000;
    EXPECT_EQ(make_scene(options).status().exit_code(), 2);
    options = wanted(folder.path(), 1000);
    options.kind = "clutter";
    EXPECT_EQ(make_scene(options).status().exit_code(), 2);
}

// Every return lies on what the city has there, or inside a crown.
TEST(ProceduralScan, ReturnsLieOnTheCity) {
    const City city(600, 3);
    Random random(17);
    uint64_t walls = 0, roofs = 0, leaves = 0;
    for (int i = 0; i < 50'000; ++i) {
        const Pulse pulse = {random.uniform(0, 600), random.uniform(0, 600), random.uniform(-0.53, 0.53), random.uniform(-0.7, 0.7)};
        ScanPoint returns[most_returns];
        const uint32_t count = scan(city, pulse, random, returns);
        ASSERT_LE(count, most_returns);
        for (uint32_t r = 0; r < count; ++r) {
            const ScanPoint& p = returns[r];
            EXPECT_EQ(p.return_number, r + 1);
            EXPECT_EQ(p.return_count, count);
            // The range is measured to 1.5 cm, at 3.5 sigma; and the ground's height is found to a few.
            EXPECT_LT(p.z, returns[r == 0 ? 0 : r - 1].z + 0.11);
            EXPECT_GT(p.z, city.ground_height(p.x, p.y) - 0.2) << "nothing is under the ground";
            const CityCell& cell = city.cell(city.column(p.x), city.row(p.y));
            const double margin = 0.06;
            if (p.kind == building) {
                const bool on_one = std::ranges::any_of(city.boxes(cell), [&](const CityBox& b) {
                    const bool inside = p.x > b.x0 - margin && p.x < b.x1 + margin && p.y > b.y0 - margin && p.y < b.y1 + margin;
                    const bool wall = std::min({std::abs(p.x - b.x0), std::abs(p.x - b.x1), std::abs(p.y - b.y0), std::abs(p.y - b.y1)}) < margin;
                    const bool roof = p.z > b.eaves - margin && p.z < b.eaves + b.ridge + margin;
                    if (inside && wall) ++walls;
                    if (inside && roof) ++roofs;
                    return inside && (wall || roof) && p.z < b.eaves + b.ridge + margin;
                });
                EXPECT_TRUE(on_one) << p.x << " " << p.y << " " << p.z;
            } else if (p.kind == high_vegetation) {
                ++leaves;
                const bool in_one = std::ranges::any_of(city.trees(cell), [&](const CityTree& t) {
                    return std::hypot((p.x - t.x) / t.radius, (p.y - t.y) / t.radius, (p.z - t.z) / t.half_height) < 1.3;
                });
                EXPECT_TRUE(in_one) << p.x << " " << p.y << " " << p.z;
            }
        }
    }
    EXPECT_GT(walls, 500u);
    EXPECT_GT(roofs, 2000u);
    EXPECT_GT(leaves, 1000u);
}

}  // namespace
}  // namespace raypager
