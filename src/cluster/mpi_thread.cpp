#include "cluster/mpi_thread.hpp"

#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include "base/check.hpp"
#include "base/log.hpp"

namespace raypager {
namespace {

// Slots are reused, for tags are few: 32767 are promised. Those below first_answer are the tags of messages that all ranks expect.
constexpr int question_tag = 15, first_answer = 16;
constexpr uint32_t max_slots = 8192;
constexpr int first_data = first_answer + static_cast<int>(max_slots);

// Between looks at what has come. It does not spin: where kernels keep all cores busy, a thread that has slept gets one at once, and one that spins
// has used up its share (a block took 3.4 to 4 ms to come, and takes about one: bench/journal/cluster.md).
constexpr std::chrono::microseconds long_nap{100}, nap{30};
constexpr std::chrono::milliseconds soon_after{1};
[[maybe_unused]] constexpr unsigned long nap_slack = 1000;  // nanoseconds; Linux makes naps 50 us longer by itself
// Between looks at whether others are waited for too long.
constexpr std::chrono::milliseconds between_looks{500};
// Between looks at whether whoever asks has given up.
constexpr double patience = 0.2;
const std::atomic<bool> never{false};

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
    told_.resize(static_cast<size_t>(count_));
    calls_.resize(static_cast<size_t>(count_));
    ready_ = true;
    for_others_.notify_all();
}

// Others may ask until they, too, have come to their end; and all have got their answers before anybody leaves.
void MpiThread::end_mpi() {
    in_task_ = true;
    const auto all_come_here = [this] {
        steps_++;
        MPI_Request all_have = MPI_REQUEST_NULL;
        MPI_Ibarrier(MPI_COMM_WORLD, &all_have);
        wait(all_have);
    };
    all_come_here();
    may_call_ = false;
    while (has_asked()) idle(poll());
    all_come_here();
    while (!served_.empty()) idle(poll());
    MPI_Finalize();
}

bool MpiThread::has_asked() const {
    const std::lock_guard lock(mutex_);
    return under_way_ > 0 || !to_ask_.empty();
}

void MpiThread::work() {
#ifdef __linux__
    prctl(PR_SET_TIMERSLACK, nap_slack);
#endif
    begin_mpi();
    try {
        for (;;) {
            const std::function<void()>* task = nullptr;
            {
                const std::lock_guard lock(mutex_);
                if (stop_) break;
                task = task_;
            }
            if (task) carry_out(*task);
            idle(poll());
        }
        end_mpi();
    } catch (const std::bad_alloc&) {  // nobody else can say so
        log_note("out of memory while answering other ranks; give a smaller --host-limit or --memory-limit");
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
}

void MpiThread::carry_out(const std::function<void()>& task) {
    in_task_ = true;
    steps_++;
    std::exception_ptr error;
    try {
        task();
    } catch (...) {
        error = std::current_exception();
    }
    in_task_ = false;
    const std::lock_guard lock(mutex_);
    error_ = error;
    task_ = nullptr;
    for_others_.notify_all();
}

void MpiThread::run(const std::function<void()>& task) {
    std::unique_lock lock(mutex_);
    RAYPAGER_CHECK(task_ == nullptr);
    task_ = &task;
    for_thread_.notify_all();
    for_others_.wait(lock, [this] { return task_ == nullptr; });
    if (const std::exception_ptr error = std::exchange(error_, nullptr)) std::rethrow_exception(error);
}

void MpiThread::wait(MPI_Request request) {
    wait_begin_ = Clock::now();
    for (int done = 0;;) {
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
        if (done) break;
        idle(poll());
    }
    wait_begin_.reset();
}

double MpiThread::waited(Clock::time_point now) const {
    Clock::time_point begin = wait_begin_.value_or(now);
    for (const std::shared_ptr<Asked>& asked : asked_)
        if (asked && asked->is_waited_for) begin = std::min(begin, asked->begin);
    return std::chrono::duration<double>(now - begin).count();
}

// All that wait for long ask all; who answers is there.
void MpiThread::look_who_is_late() {
    const auto now = Clock::now();
    if (!may_call_ || now - last_look_ < between_looks) return;
    last_look_ = now;
    const double seconds = waited(now);
    if (seconds < RollCall::first) {
        next_call_ = RollCall::first;
        call_begin_.reset();
    } else if (call_begin_ && std::chrono::duration<double>(now - *call_begin_).count() >= RollCall::grace) {
        call_begin_.reset();
        const std::string text = who_is_late();
        if (!text.empty()) log_warning(text);
    } else if (!call_begin_ && seconds >= next_call_) {
        next_call_ = 2 * seconds;
        call_begin_ = now;
        call_all();
    }
}

// Those that have not answered the last time have not been there since.
void MpiThread::call_all() {
    const std::lock_guard lock(mutex_);
    for (size_t rank = 0; rank < calls_.size(); rank++) {
        if (static_cast<int>(rank) == rank_ || (calls_[rank] && !calls_[rank]->done)) continue;
        calls_[rank] = make_question({Question::call, 0, 0, 0}, static_cast<uint32_t>(rank), sizeof(RollCall::Answer));
        calls_[rank]->is_waited_for = false;
        to_ask_.push_back(calls_[rank]);
    }
}

std::string MpiThread::who_is_late() const {
    std::vector<std::optional<RollCall::Answer>> answers(calls_.size());
    answers[static_cast<size_t>(rank_)] = here();
    const std::lock_guard lock(mutex_);
    for (size_t rank = 0; rank < calls_.size(); rank++) {
        if (!calls_[rank] || !calls_[rank]->done) continue;
        answers[rank].emplace();
        std::memcpy(&*answers[rank], calls_[rank]->answer.get(), sizeof(RollCall::Answer));
    }
    return RollCall::text(static_cast<uint32_t>(rank_), answers);
}

void MpiThread::idle(bool happened) {
    look_who_is_late();
    const auto now = Clock::now();
    if (happened) {
        last_event_ = now;
        return;
    }
    const bool soon = under_way_ > 0 || !served_.empty() || now - last_event_ < soon_after;
    std::unique_lock lock(mutex_);
    if (to_ask_.empty() && (in_task_ || (!task_ && !stop_))) for_thread_.wait_for(lock, soon ? nap : long_nap);
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
    MPI_Irecv(asked->answer.get(), static_cast<int>(asked->answer_bytes), MPI_BYTE, asked->to, first_answer + tag, MPI_COMM_WORLD,
              &asked->requests[0]);
    MPI_Isend(&question, sizeof question, MPI_BYTE, asked->to, question_tag, MPI_COMM_WORLD, &asked->requests[1]);
    if (question.kind == Question::tell || question.kind == Question::put)
        MPI_Isend(asked->sent.data(), static_cast<int>(asked->sent.size()), MPI_BYTE, asked->to, first_data + tag, MPI_COMM_WORLD,
                  &asked->requests[2]);
    asked_[slot] = std::move(asked);
    under_way_++;
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
        under_way_--;
        free_slots_.push_back(asked->question.slot);
        const std::lock_guard lock(mutex_);
        asked->done = true;
        asked->changed.notify_all();
        asked.reset();
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
    if (question.kind == Question::call) {
        served.here = here();
        return send(served, &served.here, sizeof served.here);
    }
    const std::lock_guard lock(mutex_);
    served.shelf = shelf_;
    if (shelf_) served.memory = shelf_->memory();
    if (question.kind == Question::get) {
        std::span<const std::byte> found;
        served.code = shelf_ ? shelf_->find(question.number, found) : Code::none;
        if (served.code == Code::bytes && found.size() != question.value) served.code = Code::none;
        return served.code == Code::bytes ? send(served, found.data(), found.size()) : send(served, &served.code, sizeof served.code);
    }
    const bool for_shelf = shelf_ && question.kind == Question::put && question.value > 0;
    std::span<std::byte> room = for_shelf ? shelf_->room_for(question.number) : std::span<std::byte>();
    if (room.size() != question.value) {
        served.own.resize(question.value);
        room = served.own;
    }
    served.receives = true;
    MPI_Irecv(room.data(), static_cast<int>(room.size()), MPI_BYTE, served.from, first_data + static_cast<int>(question.slot), MPI_COMM_WORLD,
              &served.request);
}

bool MpiThread::see_served() {
    bool any = false;
    for (auto served = served_.begin(); served != served_.end();) {
        int done = 0;
        MPI_Test(&served->request, &done, MPI_STATUS_IGNORE);
        any = any || done;
        if (!done) {
            ++served;
        } else if (served->receives) {
            end_received(*served);
        } else {
            served = served_.erase(served);
        }
    }
    return any;
}

void MpiThread::end_received(Served& served) {
    served.receives = false;
    {
        const std::lock_guard lock(mutex_);
        const uint64_t number = served.question.number;
        const bool told = served.question.kind == Question::tell, is_for_shelf = !told && shelf_ && shelf_ == served.shelf;
        if (told) told_[static_cast<size_t>(served.from)] = std::move(served.own);
        if (is_for_shelf && served.question.value == 0) shelf_->will_not_come(number);
        if (told || (is_for_shelf && served.question.value > 0 && served.own.empty() && shelf_->has_come(number))) served.code = Code::bytes;
    }
    send(served, &served.code, sizeof served.code);
}

std::shared_ptr<MpiThread::Asked> MpiThread::make_question(const Question& question, uint32_t to, size_t answer_bytes) {
    auto asked = std::make_shared<Asked>();
    asked->question = question;
    asked->to = static_cast<int>(to);
    asked->answer_bytes = answer_bytes;
    asked->answer.reset(new std::byte[answer_bytes]);
    return asked;
}

bool MpiThread::ask(const std::shared_ptr<Asked>& asked, double seconds, const std::atomic<bool>& stop) {
    const auto begin = Clock::now();
    std::unique_lock lock(mutex_);
    to_ask_.push_back(asked);
    for_thread_.notify_all();
    while (!asked->done && !stop) {
        const double left = seconds - std::chrono::duration<double>(Clock::now() - begin).count();
        if (left <= 0) break;
        asked->changed.wait_for(lock, std::chrono::duration<double>(std::min(left, patience)));
    }
    asked->is_waited_for = false;
    return asked->done;
}

uint64_t MpiThread::add(uint32_t number, uint64_t value) { return *add_soon(number, value, std::numeric_limits<double>::infinity()); }

std::optional<uint64_t> MpiThread::add_soon(uint32_t number, uint64_t value, double seconds) {
    const auto asked = make_question({Question::add, 0, number, value}, 0, sizeof(uint64_t));
    if (!ask(asked, seconds, never)) return std::nullopt;
    uint64_t before = 0;
    std::memcpy(&before, asked->answer.get(), sizeof before);
    return before;
}

void MpiThread::tell(std::vector<std::byte> bytes) {
    const auto asked = make_question({Question::tell, 0, 0, bytes.size()}, 0, sizeof(Code));
    asked->sent = std::move(bytes);
    ask(asked, std::numeric_limits<double>::infinity(), never);
}

std::vector<std::vector<std::byte>> MpiThread::told() const {
    const std::lock_guard lock(mutex_);
    return told_;
}

Peers::Answer MpiThread::get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds, const std::atomic<bool>& stop) {
    const auto asked = make_question({Question::get, 0, number, bytes.size()}, rank, bytes.size());
    if (!ask(asked, seconds, stop)) return Code::late;
    if (asked->answer_bytes == sizeof(Code)) return static_cast<Code>(asked->answer[0]);
    std::copy_n(asked->answer.get(), bytes.size(), bytes.begin());
    return Code::bytes;
}

Peers::Answer MpiThread::put(uint32_t rank, uint64_t number, std::vector<std::byte> bytes, const std::atomic<bool>& stop) {
    const auto asked = make_question({Question::put, 0, number, bytes.size()}, rank, sizeof(Code));
    asked->sent = std::move(bytes);
    return ask(asked, std::numeric_limits<double>::infinity(), stop) ? static_cast<Code>(asked->answer[0]) : Code::late;
}

void MpiThread::serve(Peers::Shelf* shelf) {
    const std::lock_guard lock(mutex_);
    shelf_ = shelf;
}

}  // namespace raypager
