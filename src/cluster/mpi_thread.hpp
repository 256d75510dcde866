// The thread that makes all calls of MPI: few builds of MPI can be called from several threads. It answers the other ranks whatever else goes on.
#pragma once

#include <mpi.h>

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "raypager/peers.hpp"

namespace raypager {

class MpiThread {
public:
    MpiThread();   // begins MPI
    ~MpiThread();  // ends it, once all ranks have come to that

    int rank() const { return rank_; }
    int count() const { return count_; }
    int local_count() const { return local_count_; }

    // Carries out something on the thread and returns when it is done. One at a time. In it, only wait() may wait for other ranks.
    void run(const std::function<void()>& task);
    void wait(MPI_Request request);  // on the thread

    // See Peers; from any thread.
    uint64_t add(uint32_t number, uint64_t value);
    Peers::Answer get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds);
    bool put(uint32_t rank, uint64_t number, std::span<const std::byte> bytes);
    void serve(Peers::Shelf* shelf);

private:
    using Code = Peers::Answer;
    struct Question {
        enum Kind : uint32_t { add, get, put } kind = add;
        uint32_t slot = 0;  // of who asks: says which tags answer and bytes have
        uint64_t number = 0;
        uint64_t value = 0;  // of get and put: how many bytes
    };
    // What this rank asks of another. Whoever waits for it may give up before it is answered.
    struct Asked {
        Question question;
        int to = 0;
        std::span<const std::byte> sent;  // of put
        std::vector<std::byte> answer;
        size_t answer_bytes = 0;
        std::array<MPI_Request, 3> requests = {MPI_REQUEST_NULL, MPI_REQUEST_NULL, MPI_REQUEST_NULL};  // the answer's first
        bool done = false;
    };
    // What another rank asks, while something is sent or received for it.
    struct Served {
        Question question;
        int from = 0;
        uint64_t value = 0;
        Code code = Code::none;
        std::vector<std::byte> scrap;  // what has no place
        MPI_Request request = MPI_REQUEST_NULL;
        bool receives = false, reads_shelf = false;
    };

    void work();
    void begin_mpi();
    void end_mpi();
    bool poll();  // false: nothing has happened
    void idle(bool happened);
    bool begin_asked();
    bool see_answers();
    bool take_questions();
    bool see_served();
    void answer(Served& served);
    void send(Served& served, const void* bytes, size_t count);
    std::shared_ptr<Asked> ask(std::shared_ptr<Asked> asked, double seconds);

    int rank_ = 0, count_ = 1, local_count_ = 1;
    std::mutex mutex_;
    std::condition_variable for_thread_, for_others_;
    // Under the mutex.
    const std::function<void()>* task_ = nullptr;
    std::deque<std::shared_ptr<Asked>> to_ask_;
    bool ready_ = false, stop_ = false;
    Peers::Shelf* shelf_ = nullptr;
    uint32_t shelf_readers_ = 0;
    // The thread's own.
    std::vector<std::shared_ptr<Asked>> asked_;
    std::vector<uint32_t> free_slots_;
    std::list<Served> served_;
    std::array<uint64_t, Peers::common_numbers> numbers_{};
    uint32_t quiet_polls_ = 0;
    std::thread thread_;
};

}  // namespace raypager
