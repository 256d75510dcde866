// The thread that makes all calls of MPI: few builds of MPI can be called from several threads. It answers the other ranks whatever else goes on.
#pragma once

#include <mpi.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "cluster/roll_call.hpp"
#include "raypager/peers.hpp"

namespace raypager {

class MpiThread {
public:
    MpiThread();   // begins MPI
    ~MpiThread();  // ends it, once all ranks have come to that

    int rank() const { return rank_; }
    int count() const { return count_; }
    int local_count() const { return local_count_; }

    // Carries out something on the thread and returns when it is done, or throws what that throws. One at a time. In it, only wait() may wait for
    // other ranks.
    void run(const std::function<void()>& task);
    void wait(MPI_Request request);  // on the thread

    // See Peers; from any thread.
    uint64_t add(uint32_t number, uint64_t value);
    // The same, unless rank 0 does not answer in so many seconds.
    std::optional<uint64_t> add_soon(uint32_t number, uint64_t value, double seconds);
    void tell(std::vector<std::byte> bytes);
    std::vector<std::vector<std::byte>> told() const;
    Peers::Answer get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds, const std::atomic<bool>& stop);
    Peers::Answer put(uint32_t rank, uint64_t number, std::vector<std::byte> bytes, const std::atomic<bool>& stop);
    void serve(Peers::Shelf* shelf);

private:
    using Code = Peers::Answer;
    using Clock = std::chrono::steady_clock;
    struct Question {
        enum Kind : uint32_t { add, tell, get, put, call } kind = add;
        uint32_t slot = 0;  // of who asks: says which tags answer and bytes have
        uint64_t number = 0;
        uint64_t value = 0;  // of all but add: how many bytes
    };
    // What this rank asks of another. Whoever waits for it may give up before it is answered.
    struct Asked {
        Question question;
        int to = 0;
        std::vector<std::byte> sent;  // of tell and put
        std::unique_ptr<std::byte[]> answer;
        size_t answer_bytes = 0;                                                                       // that there is room for, then that have come
        std::array<MPI_Request, 3> requests = {MPI_REQUEST_NULL, MPI_REQUEST_NULL, MPI_REQUEST_NULL};  // the answer's first
        bool done = false;
        std::atomic<bool> is_waited_for{true};
        Clock::time_point begin = Clock::now();
        std::condition_variable changed;
    };
    // What another rank asks, while something is sent or received for it.
    struct Served {
        Question question;
        int from = 0;
        uint64_t value = 0;
        RollCall::Answer here;
        Code code = Code::none;
        std::vector<std::byte> own;  // what is told, or has no place
        MPI_Request request = MPI_REQUEST_NULL;
        bool receives = false;
        const Peers::Shelf* shelf = nullptr;  // that it is answered from
        std::shared_ptr<const void> memory;   // that is sent or received
    };

    void work();
    void carry_out(const std::function<void()>& task);
    void begin_mpi();
    void end_mpi();
    bool poll();  // false: nothing has happened
    void idle(bool happened);
    bool has_asked() const;
    double waited(Clock::time_point now) const;
    RollCall::Answer here() const { return {steps_, waited(Clock::now())}; }
    void look_who_is_late();
    void call_all();
    std::string who_is_late() const;
    bool begin_asked();
    bool see_answers();
    bool take_questions();
    bool see_served();
    void answer(Served& served);
    void send(Served& served, const void* bytes, size_t count);
    void end_received(Served& served);
    static std::shared_ptr<Asked> make_question(const Question& question, uint32_t to, size_t answer_bytes);
    // False: was not answered in time.
    bool ask(const std::shared_ptr<Asked>& asked, double seconds, const std::atomic<bool>& stop);

    int rank_ = 0, count_ = 1, local_count_ = 1;
    mutable std::mutex mutex_;
    std::condition_variable for_thread_, for_others_;
    // Under the mutex.
    const std::function<void()>* task_ = nullptr;
    std::deque<std::shared_ptr<Asked>> to_ask_;
    std::exception_ptr error_;  // of the task
    bool ready_ = false, stop_ = false;
    Peers::Shelf* shelf_ = nullptr;
    std::vector<std::vector<std::byte>> told_;  // by rank
    // The thread's own.
    std::vector<std::shared_ptr<Asked>> asked_;
    std::vector<uint32_t> free_slots_;
    std::list<Served> served_;
    std::array<uint64_t, Peers::common_numbers> numbers_{};
    uint32_t under_way_ = 0;                       // of what is asked
    bool in_task_ = false;                         // or at the end: others wait for this thread
    uint64_t steps_ = 0;                           // tasks that have begun
    std::optional<Clock::time_point> wait_begin_;  // in a task
    std::vector<std::shared_ptr<Asked>> calls_;    // by rank: whether it is there
    std::optional<Clock::time_point> call_begin_;  // while answers are waited for
    double next_call_ = RollCall::first;           // seconds of waiting
    bool may_call_ = true;                         // not in the last moment
    Clock::time_point last_event_, last_look_;
    std::thread thread_;
};

}  // namespace raypager
