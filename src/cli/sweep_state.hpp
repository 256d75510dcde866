// The finished runs of a sweep, kept in its folder as they come: what is stopped or killed goes on from there.
#pragma once

#include <filesystem>
#include <vector>

#include "base/files.hpp"
#include "bench/sweep.hpp"

namespace raypager {

// One file, sweep.runs: lines of JSON. The first says what all runs have in common, each of the others is a run, and the last one marks the end.
class SweepState {
public:
    // resume: reads what is there, and refuses it if it is of another scene, program or options; variants and repeats may be others. Otherwise begins
    // anew, unless that would lose the runs of a sweep that was stopped.
    static Result<SweepState> open(const std::filesystem::path& folder, const bench::SweepSettings& settings, const BakedScene& scene, bool resume);
    // Those of earlier that are among the variants of this sweep.
    const std::vector<bench::SweepRun>& earlier() const { return earlier_; }
    Status add(const bench::SweepRun& run, const bench::SweepVariant& variant);
    Status finish();

private:
    std::filesystem::path path_;
    std::vector<bench::SweepRun> earlier_;
    std::string device_;  // of the first run
    GrowingFile file_;
};

}  // namespace raypager
