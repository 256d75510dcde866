// LAS point clouds.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/cloud.hpp"
#include "unit/cloud_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    std::vector<std::string> result;
    for (const auto& [minor, format] : {std::pair<uint8_t, uint8_t>{0, 0}, {2, 3}, {3, 5}, {4, 7}, {4, 10}}) {
        test::LasFile file;
        file.minor = minor;
        file.format = format;
        for (int32_t i = 0; i < 5; i++) file.points.push_back({{i, 2 * i, -i}, 100, 2, i == 3, {1000, 2000, static_cast<uint16_t>(i)}});
        file.variable_records = test::las_variable_record("LASF_Projection", 34735, "keys");
        file.variable_record_count = 1;
        result.push_back(test::to_las(file));
    }
    return result;
}

void run(std::string_view input) { load_cloud(".las", input); }

}  // namespace raypager::fuzz
