#include "render/device_group.hpp"

#include <algorithm>
#include <chrono>
#include <new>

namespace raypager {
namespace {

using namespace std::chrono_literals;

// Of who has nothing to do: how long until it looks again.
constexpr auto nap = 2ms;
// Of step(): long enough that the caller's thread takes no processor's time, short enough for who watches.
constexpr auto step_time = 10ms;

}  // namespace

void DeviceGroup::begin(std::vector<std::unique_ptr<DeviceWorker>> workers, SamplePool& pool, bool shared) {
    shared_ = shared;
    pool_ = &pool;
    for (std::unique_ptr<DeviceWorker>& worker : workers) {
        members_.push_back(std::make_unique<Member>());
        members_.back()->figures = worker->figures();
        workers_.push_back(worker.get());
        members_.back()->worker = std::move(worker);
    }
    threaded_ = members_.size() > 1;
    if (!several()) return;
    for (const std::unique_ptr<Member>& member : members_) member->thread = std::thread([this, raw = member.get()] { run(*raw); });
}

DeviceGroup::~DeviceGroup() { stop(); }

// Those that wait for room in the cache get none when others have stopped.
void DeviceGroup::stop() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    if (several())
        for (const std::unique_ptr<Member>& member : members_)
            if (member->worker->usable()) member->worker->rounds().residency().cache()->close();
    for (const std::unique_ptr<Member>& member : members_)
        if (member->thread.joinable()) member->thread.join();
    // The first one's device has pinned the memory of the cache.
    for (size_t i = members_.size(); i-- > 0;) members_[i].reset();
}

void DeviceGroup::run(Member& member) {
    std::unique_lock lock(mutex_);
    while (!stop_ && member.error.ok()) {
        Status status;
        try {
            status = work(member, lock);
        } catch (const std::bad_alloc&) {
            if (!lock.owns_lock()) lock.lock();
            status = Status::failed("out of memory; close other programs, or give a smaller --host-limit or --memory-limit");
        }
        if (!status) member.error = status;
        if (member.worker->usable()) member.figures = member.worker->figures();
    }
    member.ended = true;
    changed_.notify_all();
}

// Holds the lock before and after, not while the device works.
Status DeviceGroup::work(Member& member, std::unique_lock<std::mutex>& lock) {
    const auto unlocked = [&lock](const auto& act) {
        lock.unlock();
        auto status = act();
        lock.lock();
        return status;
    };
    DeviceWorker& worker = *member.worker;
    if (parking_) {
        RAYPAGER_TRY(unlocked([&] { return worker.settle(); }));
        member.figures = worker.figures();
        member.parked = true;
        changed_.notify_all();
        while (parking_ && !stop_ && member.error.ok()) {
            if (!still_) {
                member.takes_arrivals = true;
                const Status status = unlocked([&] { return worker.take_arrivals(); });
                member.takes_arrivals = false;
                RAYPAGER_TRY(status);
                if (still_) changed_.notify_all();
            }
            changed_.wait_for(lock, nap);
        }
        member.parked = false;
        return {};
    }
    // Who is idle stays so while there is nothing to take: then all are idle at the same time in the end.
    if (!member.idle || pool_->left() > 0 || !pool_->again().empty()) {
        member.idle = false;
        const auto busy = unlocked([&] { return worker.take_samples(); });
        if (!busy) return busy.status();
        member.idle = !*busy;
        if (*busy) return unlocked([&] { return worker.round(); });
        changed_.notify_all();
    }
    worker.watchdog().waits_for_others();
    RAYPAGER_TRY(unlocked([&] { return worker.take_arrivals(); }));
    changed_.wait_for(lock, nap);
    return {};
}

Status DeviceGroup::step() {
    Member& first = *members_.front();
    if (!several()) {
        const auto busy = first.worker->take_samples();
        if (!busy) return busy.status();
        first.idle = shared_ && !*busy;
        if (first.idle) {
            first.worker->watchdog().waits_for_others();
            std::this_thread::sleep_for(nap);
            return {};
        }
        RAYPAGER_TRY(first.worker->round());
        first.figures = first.worker->figures();
        return {};
    }
    std::unique_lock lock(mutex_);
    still_ = false;
    if (std::exchange(parking_, false)) changed_.notify_all();
    const auto over = [this] {
        const auto ended = [](const auto& m) { return m->ended; };
        return std::any_of(members_.begin(), members_.end(), ended) ||
               std::all_of(members_.begin(), members_.end(), [](const auto& m) { return m->idle; });
    };
    // Where all are idle already, it is another process that they wait for.
    if (over())
        changed_.wait_for(lock, nap);
    else
        changed_.wait_for(lock, step_time, over);
    return {};
}

Status DeviceGroup::settle(bool still) {
    if (!several()) {
        Member& first = *members_.front();
        RAYPAGER_TRY(first.worker->settle());
        first.figures = first.worker->figures();
        return {};
    }
    std::unique_lock lock(mutex_);
    parking_ = true;
    still_ = false;
    changed_.notify_all();
    // Others may wait for room that one that has failed holds in the cache.
    changed_.wait(lock, [this] {
        return std::all_of(members_.begin(), members_.end(), [](const auto& m) { return m->parked; }) ||
               std::any_of(members_.begin(), members_.end(), [](const auto& m) { return m->ended; });
    });
    if (std::any_of(members_.begin(), members_.end(), [](const auto& m) { return m->ended; })) return {};
    still_ = still;
    if (still)
        changed_.wait(lock, [this] { return std::none_of(members_.begin(), members_.end(), [](const auto& m) { return m->takes_arrivals; }); });
    // What has come since they parked counts as well.
    for (const std::unique_ptr<Member>& member : members_)
        if (still && member->worker->usable()) member->figures = member->worker->figures();
    return {};
}

bool DeviceGroup::idle() const {
    const std::lock_guard lock(mutex_);
    return pool_->left() == 0 && pool_->again().empty() &&
           std::all_of(members_.begin(), members_.end(), [](const auto& m) { return m->idle && m->error.ok(); });
}

DeviceGroup::Failure DeviceGroup::failed() const {
    const std::lock_guard lock(mutex_);
    for (const std::unique_ptr<Member>& member : members_)
        if (!member->error.ok()) return {member->worker.get(), member->error, member->figures};
    return {};
}

void DeviceGroup::fail(const DeviceWorker& worker, const Status& error) {
    const std::lock_guard lock(mutex_);
    for (const std::unique_ptr<Member>& member : members_)
        if (member->worker.get() == &worker) member->error = error;
    changed_.notify_all();
}

void DeviceGroup::drop(DeviceWorker& worker) {
    const auto found = std::find_if(members_.begin(), members_.end(), [&](const auto& m) { return m->worker.get() == &worker; });
    (*found)->thread.join();
    std::unique_ptr<Device> device = worker.release_device();
    if (!cache_device_ && found == members_.begin()) cache_device_ = std::move(device);
    std::erase(workers_, &worker);
    const std::lock_guard lock(mutex_);
    members_.erase(found);
}

std::vector<WorkerFigures> DeviceGroup::figures() const {
    const std::lock_guard lock(mutex_);
    std::vector<WorkerFigures> all;
    for (const std::unique_ptr<Member>& member : members_) all.push_back(member->figures);
    return all;
}

void DeviceGroup::note_figures() {
    const std::lock_guard lock(mutex_);
    for (const std::unique_ptr<Member>& member : members_) {
        if (member->worker->usable()) member->figures = member->worker->figures();
        member->idle = false;
    }
}

void DeviceGroup::doing(const char* what) {
    for (DeviceWorker* worker : workers_) worker->watchdog().doing(what);
}

void DeviceGroup::expect_progress(bool expected) {
    for (DeviceWorker* worker : workers_) expected ? worker->watchdog().resume() : worker->watchdog().pause();
}

}  // namespace raypager
