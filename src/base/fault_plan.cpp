#include "base/fault_plan.hpp"

#include <cerrno>
#include <chrono>
#include <thread>

namespace raypager {
namespace {

bool counted_down(std::atomic<int64_t>& countdown) { return countdown.load(std::memory_order_relaxed) > 0 && countdown.fetch_sub(1) == 1; }

// The next number of the plan's sequence (splitmix64). Which operation gets it depends on how threads happen to run.
uint64_t next_random(const FaultPlan& plan) {
    static std::atomic<uint64_t> counter{0};
    uint64_t z = (counter.fetch_add(1) + plan.seed.load()) * 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

}  // namespace

FaultPlan& fault_plan() {
    static FaultPlan plan;
    return plan;
}

void FaultPlan::clear() {
    fail_read_in = fail_write_in = fail_any_in = 0;
    error_number = 0;
    longest_delay_us = one_short_in = 0;
    only_file = nullptr;
}

void inject_delay() {
    const FaultPlan& plan = fault_plan();
    if (const uint32_t longest = plan.longest_delay_us.load(std::memory_order_relaxed))
        std::this_thread::sleep_for(std::chrono::microseconds(next_random(plan) % (longest + 1)));
}

Fault inject_fault(FileOperation operation, const std::filesystem::path& path) {
    FaultPlan& plan = fault_plan();
    inject_delay();
    const bool transfer = operation == FileOperation::read || operation == FileOperation::write;
    bool hit = counted_down(plan.fail_any_in);
    if (operation == FileOperation::write) hit |= counted_down(plan.fail_write_in);
    const char* const only_file = plan.only_file;
    if (operation == FileOperation::read && (!only_file || path.filename() == only_file)) hit |= counted_down(plan.fail_read_in);
    if (hit) {
        plan.hit = operation;
        if (const int error = plan.error_number; error != 0) {
            errno = error;
            return Fault::error;
        }
    }
    const uint32_t one_in = plan.one_short_in.load(std::memory_order_relaxed);
    return transfer && (hit || (one_in && next_random(plan) % one_in == 0)) ? Fault::shortened : Fault::none;
}

}  // namespace raypager
