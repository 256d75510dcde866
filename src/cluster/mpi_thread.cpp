#include "cluster/mpi_thread.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>

#include "base/check.hpp"

namespace raypager {
namespace {

// Slots are reused, for tags are few: 32767 are promised. Those below first_answer are the tags of messages that all ranks expect.
constexpr int question_tag = 15, first_answer = 16;
constexpr uint32_t max_slots = 8192;
constexpr int first_data = first_answer + static_cast<int>(max_slots);

constexpr uint32_t polls_before_sleep = 64;
constexpr auto nap = std::chrono::microseconds(50);

}  // namespace

MpiThread::MpiThread() {
    thread_ = std::thread([this] { work(); });
    std::unique_lock lock(mutex_);
    for_others_.wait(lock, [this] { return ready_; });
}

MpiThread::~MpiThread() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    for_thread_.notify_all();
    thread_.join();
}

void MpiThread::begin_mpi() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    MPI_Comm local = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &local);
    MPI_Comm_size(local, &local_count_);
    MPI_Comm_free(&local);
    const std::lock_guard lock(mutex_);
    ready_ = true;
    for_others_.notify_all();
}

// Others may ask until they, too, have come to their end.
void MpiThread::end_mpi() {
    const auto is_asked = [](const std::shared_ptr<Asked>& asked) { return asked != nullptr; };
    while (std::any_of(asked_.begin(), asked_.end(), is_asked)) idle(poll());
    MPI_Request all_have = MPI_REQUEST_NULL;
    MPI_Ibarrier(MPI_COMM_WORLD, &all_have);
    wait(all_have);
    while (!served_.empty()) idle(poll());
    MPI_Finalize();
}

void MpiThread::work() {
    begin_mpi();
    for (;;) {
        const std::function<void()>* task = nullptr;
        {
            const std::lock_guard lock(mutex_);
            if (stop_) break;
            task = task_;
        }
        if (task) {
            (*task)();
            const std::lock_guard lock(mutex_);
            task_ = nullptr;
            for_others_.notify_all();
        }
        idle(poll());
    }
    end_mpi();
}

void MpiThread::run(const std::function<void()>& task) {
    std::unique_lock lock(mutex_);
    RAYPAGER_CHECK(task_ == nullptr);
    task_ = &task;
    for_thread_.notify_all();
    for_others_.wait(lock, [this] { return task_ == nullptr; });
}

void MpiThread::wait(MPI_Request request) {
    for (;;) {
        int done = 0;
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
        if (done) return;
        idle(poll());
    }
}

// Kernels may run on the same cores. So it looks often only while there is something to see.
void MpiThread::idle(bool happened) {
    quiet_polls_ = happened ? 0 : quiet_polls_ + 1;
    if (quiet_polls_ < polls_before_sleep) {
        std::this_thread::yield();
        return;
    }
    std::unique_lock lock(mutex_);
    if (to_ask_.empty() && !task_ && !stop_) for_thread_.wait_for(lock, nap);
}

bool MpiThread::poll() {
    const bool began = begin_asked(), answered = see_answers(), was_asked = take_questions(), served = see_served();
    return began || answered || was_asked || served;
}

bool MpiThread::begin_asked() {
    std::shared_ptr<Asked> asked;
    {
        const std::lock_guard lock(mutex_);
        if (to_ask_.empty() || (free_slots_.empty() && asked_.size() == max_slots)) return false;
        asked = std::move(to_ask_.front());
        to_ask_.pop_front();
    }
    if (free_slots_.empty()) {
        free_slots_.push_back(static_cast<uint32_t>(asked_.size()));
        asked_.emplace_back();
    }
    const uint32_t slot = free_slots_.back();
    free_slots_.pop_back();
    Question& question = asked->question;
    question.slot = slot;
    const int tag = static_cast<int>(slot);
    MPI_Irecv(asked->answer.data(), static_cast<int>(asked->answer.size()), MPI_BYTE, asked->to, first_answer + tag, MPI_COMM_WORLD,
              &asked->requests[0]);
    MPI_Isend(&question, sizeof question, MPI_BYTE, asked->to, question_tag, MPI_COMM_WORLD, &asked->requests[1]);
    if (question.kind == Question::put)
        MPI_Isend(asked->sent.data(), static_cast<int>(asked->sent.size()), MPI_BYTE, asked->to, first_data + tag, MPI_COMM_WORLD,
                  &asked->requests[2]);
    asked_[slot] = std::move(asked);
    return true;
}

bool MpiThread::see_answers() {
    bool any = false;
    for (std::shared_ptr<Asked>& asked : asked_) {
        if (!asked) continue;
        if (asked->requests[0] != MPI_REQUEST_NULL) {
            int done = 0, bytes = 0;
            MPI_Status status;
            MPI_Test(&asked->requests[0], &done, &status);
            if (!done) continue;
            MPI_Get_count(&status, MPI_BYTE, &bytes);
            asked->answer_bytes = static_cast<size_t>(bytes);
        }
        int sent = 0;
        MPI_Testall(2, &asked->requests[1], &sent, MPI_STATUSES_IGNORE);
        if (!sent) continue;
        any = true;
        free_slots_.push_back(asked->question.slot);
        const std::lock_guard lock(mutex_);
        asked->done = true;
        asked.reset();
        for_others_.notify_all();
    }
    return any;
}

bool MpiThread::take_questions() {
    for (bool any = false;; any = true) {
        int there = 0;
        MPI_Status status;
        MPI_Iprobe(MPI_ANY_SOURCE, question_tag, MPI_COMM_WORLD, &there, &status);
        if (!there) return any;
        Served& served = served_.emplace_back();
        served.from = status.MPI_SOURCE;
        MPI_Recv(&served.question, sizeof served.question, MPI_BYTE, served.from, question_tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        answer(served);
    }
}

void MpiThread::send(Served& served, const void* bytes, size_t count) {
    MPI_Isend(bytes, static_cast<int>(count), MPI_BYTE, served.from, first_answer + static_cast<int>(served.question.slot), MPI_COMM_WORLD,
              &served.request);
}

void MpiThread::answer(Served& served) {
    const Question& question = served.question;
    if (question.kind == Question::add) {
        served.value = numbers_[question.number % numbers_.size()];
        numbers_[question.number % numbers_.size()] += question.value;
        return send(served, &served.value, sizeof served.value);
    }
    const std::lock_guard lock(mutex_);
    if (question.kind == Question::get) {
        std::span<const std::byte> found;
        served.code = shelf_ ? shelf_->find(question.number, found) : Code::none;
        if (served.code == Code::bytes && found.size() != question.value) served.code = Code::none;
        if (served.code != Code::bytes) return send(served, &served.code, sizeof served.code);
        served.reads_shelf = true;
        shelf_readers_++;
        return send(served, found.data(), found.size());
    }
    std::span<std::byte> room = shelf_ ? shelf_->room_for(question.number) : std::span<std::byte>();
    served.receives = true;
    if (!room.empty() && room.size() == question.value) {
        served.code = Code::bytes;
        served.reads_shelf = true;
        shelf_readers_++;
    } else {
        if (shelf_) shelf_->has_come(question.number, false);
        served.scrap.resize(question.value);
        room = served.scrap;
    }
    MPI_Irecv(room.data(), static_cast<int>(room.size()), MPI_BYTE, served.from, first_data + static_cast<int>(question.slot), MPI_COMM_WORLD,
              &served.request);
}

bool MpiThread::see_served() {
    bool any = false;
    for (auto served = served_.begin(); served != served_.end();) {
        int done = 0;
        MPI_Test(&served->request, &done, MPI_STATUS_IGNORE);
        if (!done) {
            ++served;
            continue;
        }
        any = true;
        if (served->reads_shelf) {
            const std::lock_guard lock(mutex_);
            if (served->receives) shelf_->has_come(served->question.number, true);
            shelf_readers_--;
            served->reads_shelf = false;
            for_others_.notify_all();
        }
        if (served->receives) {
            served->receives = false;
            send(*served, &served->code, sizeof served->code);
        } else {
            served = served_.erase(served);
        }
    }
    return any;
}

std::shared_ptr<MpiThread::Asked> MpiThread::ask(std::shared_ptr<Asked> asked, double seconds) {
    std::unique_lock lock(mutex_);
    to_ask_.push_back(asked);
    for_thread_.notify_all();
    const auto done = [&] { return asked->done; };
    // Some clocks do not take a time that is very far away.
    constexpr double most = 1e6;
    if (!for_others_.wait_for(lock, std::chrono::duration<double>(std::min(seconds, most)), done)) return nullptr;
    return asked;
}

uint64_t MpiThread::add(uint32_t number, uint64_t value) {
    auto asked = std::make_shared<Asked>();
    asked->question = {Question::add, 0, number, value};
    asked->answer.resize(sizeof(uint64_t));
    uint64_t before = 0;
    asked = ask(asked, std::numeric_limits<double>::infinity());
    std::memcpy(&before, asked->answer.data(), sizeof before);
    return before;
}

Peers::Answer MpiThread::get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds) {
    auto asked = std::make_shared<Asked>();
    asked->question = {Question::get, 0, number, bytes.size()};
    asked->to = static_cast<int>(rank);
    asked->answer.resize(bytes.size());
    asked = ask(asked, seconds);
    if (!asked) return Code::late;
    if (asked->answer_bytes == sizeof(Code)) {
        Code code = Code::none;
        std::memcpy(&code, asked->answer.data(), sizeof code);
        return code;
    }
    std::ranges::copy(asked->answer, bytes.begin());
    return Code::bytes;
}

bool MpiThread::put(uint32_t rank, uint64_t number, std::span<const std::byte> bytes) {
    auto asked = std::make_shared<Asked>();
    asked->question = {Question::put, 0, number, bytes.size()};
    asked->to = static_cast<int>(rank);
    asked->sent = bytes;
    asked->answer.resize(sizeof(Code));
    asked = ask(asked, std::numeric_limits<double>::infinity());
    return static_cast<Code>(asked->answer[0]) == Code::bytes;
}

void MpiThread::serve(Peers::Shelf* shelf) {
    std::unique_lock lock(mutex_);
    // Who is being answered still reads the one before.
    shelf_ = nullptr;
    for_others_.wait(lock, [this] { return shelf_readers_ == 0; });
    shelf_ = shelf;
}

}  // namespace raypager
