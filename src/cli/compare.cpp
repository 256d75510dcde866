#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/verbs.hpp"
#include "raypager/picture.hpp"

namespace raypager {

Status run_compare(const Arguments& arguments) {
    std::vector<std::string> pictures;
    bool as_json = false;
    OptionParser parser("compare", "A B [--json]",
                        "Says how far picture A is from picture B: root mean square error, relative mean square error (B is the reference), and\n"
                        "the largest difference of a channel, all in linear light.");
    parser.inputs("a picture, A or B,", 2, 2, pictures);
    parser.flag("json", "print one JSON object: rmse, relative_mse, max_difference", as_json);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};

    const auto a = read_image(pictures[0]);
    if (!a) return a.status();
    const auto b = read_image(pictures[1]);
    if (!b) return b.status();
    const auto difference = compare_images(*a, *b);
    if (!difference) return difference.status().at(fmt::format("{} and {}", pictures[0], pictures[1]));
    if (as_json) {
        const nlohmann::ordered_json json = {
            {"rmse", difference->rmse}, {"relative_mse", difference->relative_mse}, {"max_difference", difference->max_difference}};
        std::fputs((json.dump(2) + "\n").c_str(), stdout);
        return {};
    }
    std::fputs(fmt::format("RMSE            {:.6g}\nrelative MSE    {:.6g}\nmax difference  {:.6g}\n", difference->rmse, difference->relative_mse,
                           difference->max_difference)
                   .c_str(),
               stdout);
    return {};
}

}  // namespace raypager
