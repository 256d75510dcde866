#include "base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace raypager {

namespace {
thread_local bool does_all_alone = false;
}

DoAllAlone::DoAllAlone() : before_(std::exchange(does_all_alone, true)) {}
DoAllAlone::~DoAllAlone() { does_all_alone = before_; }

size_t helping_workers() { return does_all_alone ? 1 : worker_count(); }

size_t worker_count() { return std::max<size_t>(1, std::thread::hardware_concurrency()); }

void parallel_for(size_t count, size_t piece, const std::function<void(size_t, size_t)>& work, size_t most) {
    piece = std::max<size_t>(1, piece);
    if (does_all_alone || count <= piece) {
        for (size_t begin = 0; begin < count; begin += piece) work(begin, std::min(count, begin + piece));
        return;
    }
    std::atomic<size_t> next{0};
    std::mutex mutex;
    std::exception_ptr failure;
    auto run = [&] {
        const DoAllAlone inside;
        try {
            for (size_t begin; (begin = next.fetch_add(piece)) < count;) work(begin, std::min(count, begin + piece));
        } catch (...) {
            next = count;  // no more work for anybody
            const std::lock_guard lock(mutex);
            if (!failure) failure = std::current_exception();
        }
    };
    const size_t pieces = (count + piece - 1) / piece;
    {
        std::vector<std::jthread> helpers;
        try {
            for (size_t i = 1; i < std::min({worker_count(), pieces, most}); i++) helpers.emplace_back(run);
        } catch (const std::system_error&) {  // no more threads: then with those that there are
        }
        run();
    }
    if (failure) std::rethrow_exception(failure);
}

}  // namespace raypager
