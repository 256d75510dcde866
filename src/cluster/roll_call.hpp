// What a rank says that waits for others for long: for whom, as far as it can be found out by asking all. The answers come from the threads that make
// the calls of MPI, so whoever gives none has been stopped, hangs, or cannot be reached.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/words.hpp"

namespace raypager {

class RollCall {
public:
    // Seconds: from when on all are asked, how long they have for an answer, and from when on those are named that are at work, as a rank that bakes.
    static constexpr double first = 10, grace = 2, patience_with_work = 60;

    // What a rank says of itself.
    struct Answer {
        uint64_t steps = 0;  // that all take together: how many it has begun
        double waited = 0;   // seconds, for others
    };

    // A line for the user; nothing where another rank says so, or nobody is behind. answers: by rank, this one's own among them; none: it has not
    // answered.
    static std::string text(uint32_t rank, const std::vector<std::optional<Answer>>& answers) {
        const Answer& own = *answers[rank];
        std::vector<size_t> absent, behind;
        bool another_says = false;
        for (size_t other = 0; other < answers.size(); other++) {
            const std::optional<Answer>& answer = answers[other];
            if (!answer) absent.push_back(other);
            if (answer && answer->steps < own.steps) behind.push_back(other);
            // The first of those that have waited as long; they do not all ask at the same time.
            another_says = another_says || (answer && other < rank && answer->waited >= own.waited / 2);
        }
        const std::string waits = fmt::format("rank {} has waited for {} for ", rank, format_duration(own.waited));
        if (another_says) return {};
        if (!absent.empty())
            return waits + fmt::format("{}, which {} not answer: stopped, hanging or out of reach; the render goes on if {}", names(absent),
                                       absent.size() == 1 ? "does" : "do", absent.size() == 1 ? "it does" : "they do");
        return !behind.empty() && own.waited >= patience_with_work ? waits + names(behind) + ", still at work" : std::string();
    }

private:
    static std::string names(const std::vector<size_t>& ranks) {
        constexpr size_t most = 8;
        std::string text = ranks.size() == 1 ? "rank " : "ranks ";
        for (size_t i = 0; i < ranks.size() && i < most; i++) text += fmt::format("{}{}", i == 0 ? "" : ", ", ranks[i]);
        return ranks.size() > most ? text + fmt::format(" and {} more", ranks.size() - most) : text;
    }
};

}  // namespace raypager
