#include "fuzz/support/cloud.hpp"

#include <cmath>

#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "import/cloud_file.hpp"

namespace raypager::fuzz {

void load_cloud(const std::string& ending, std::string_view input) {
    const auto file = CloudFile::open(write_input("input" + ending, input));
    if (!file) return RAYPAGER_CHECK(file.status().message().find("input" + ending) != std::string::npos);
    uint64_t points = 0;
    MeshIssues issues;
    const Status read = (*file)->stream(
        [&](std::span<const CloudPoint> piece) {
            points += piece.size();
            for (const CloudPoint& p : piece) {
                RAYPAGER_CHECK(std::isfinite(p.position.x) && std::isfinite(p.position.y) && std::isfinite(p.position.z));
                RAYPAGER_CHECK(p.radius >= 0 && std::isfinite(p.radius) && p.color <= 0xffffffu);
            }
            return Status();
        },
        issues);
    RAYPAGER_CHECK(read.ok() || read.message().find("input" + ending) != std::string::npos);
    RAYPAGER_CHECK(points + issues.not_finite <= (*file)->count());
    // A point takes two bytes at least (a line of text with one digit would be refused).
    check_proportion(points * sizeof(CloudPoint), input, 16);
    RAYPAGER_CHECK((*file)->sample().ok());
}

}  // namespace raypager::fuzz
