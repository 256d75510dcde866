// Figures of a sweep: medians over the repeats, ratios, and the tables that are made of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/sweep.hpp"

namespace raypager::bench {

// One variant over its repeats.
struct VariantFigures {
    double seconds = 0;                     // median
    double slow_down = 0;                   // median of the ratios to the same repeat of the settings' largest limit; 1 there
    double stall_share = 0;                 // of the time, median
    double rays_per_second = 0;             // median
    double bytes_loaded = 0;                // median
    double bytes_per_ray = 0;               // median
    double loads = 0, rounds = 0;           // medians
    double rmse = 0;                        // of the finished picture, of the first repeat
    std::optional<double> seconds_to_rmse;  // median; nothing if a repeat did not come so far
    double resident_percent = 0;            // of the geometry, that the pool can hold
};

// The error that all runs came to, with a little room: what seconds_to_rmse is about.
double common_rmse(const SweepResult& result);
std::vector<VariantFigures> variant_figures(const SweepResult& result);
// When a run's error first fell to this, between its points by interpolation of both logarithms.
std::optional<double> seconds_to(const std::vector<ConvergencePoint>& convergence, double rmse);
double median(std::vector<double> values);  // REQUIRES: not empty

// CSV with a header line: one row a run; one row a point of a convergence curve.
std::string runs_csv(const SweepResult& result);
std::string convergence_csv(const SweepResult& result);
// One row a block that came or left in a run that kept its journal; a run is named by its place among the runs.
std::string residency_csv(const SweepResult& result);
// For the terminal.
std::string sweep_table(const SweepResult& result);

}  // namespace raypager::bench
