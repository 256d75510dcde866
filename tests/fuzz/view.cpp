// What is read of the page's requests: targets, commands and queries.
#include <cmath>

#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "view/commands.hpp"
#include "view/request_check.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    return {"/0123/picture?after=3",
            "/0123/pick?x=10&y=20",
            "/0123/save?format=png&exposure=-0.5",
            R"({"camera": "1,2,3,4,5,6,0,1,0,40", "moving": true})",
            R"({"camera": "1,2,3,4,5,6,0,1,0,40,mirrored,lens,0.1,2"})",
            R"({"limit": "25%"})",
            R"({"limit": "512M"})"};
}

void run(std::string_view input) {
    const std::string text(input);
    if (const auto target = parse_target(text)) {
        RAYPAGER_CHECK(target->name.find('/') == std::string::npos);
        if (const auto pixel = parse_pixel_query(target->query, 640, 360)) RAYPAGER_CHECK(pixel->x < 640 && pixel->y < 360);
        if (const auto save = parse_save_query(target->query)) RAYPAGER_CHECK(std::abs(save->exposure) <= 64);
        (void)parse_after(target->query);
    }
    if (const auto command = parse_camera_command(text)) RAYPAGER_CHECK(format_camera(command->camera).size() < 1024);
    if (const auto command = parse_limit_command(text)) RAYPAGER_CHECK(command->percent >= 0 && command->percent <= 100);
    RAYPAGER_CHECK(!same_token(input, "0123456789abcdef0123456789abcdef") || input.size() == 32);
}

}  // namespace raypager::fuzz
