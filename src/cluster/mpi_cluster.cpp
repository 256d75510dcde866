#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "cluster/cluster.hpp"

namespace raypager {
namespace {

// Errors of MPI end all ranks by themselves (MPI_ERRORS_ARE_FATAL), so none comes back from its functions.
class MpiPeers final : public Peers {
public:
    MpiPeers() {
        int rank = 0, count = 1;
        MPI_Comm_rank(MPI_COMM_WORLD, &rank);
        MPI_Comm_size(MPI_COMM_WORLD, &count);
        rank_ = static_cast<uint32_t>(rank);
        count_ = static_cast<uint32_t>(count);
        MPI_Comm local = MPI_COMM_NULL;
        MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &local);
        MPI_Comm_size(local, &count);
        local_count_ = static_cast<uint32_t>(count);
        MPI_Comm_free(&local);
        const MPI_Aint bytes = rank_ == 0 ? common_numbers * sizeof(uint64_t) : 0;
        void* memory = nullptr;
        MPI_Win_allocate(bytes, sizeof(uint64_t), MPI_INFO_NULL, MPI_COMM_WORLD, &memory, &window_);
        std::fill_n(static_cast<uint64_t*>(memory), bytes / static_cast<MPI_Aint>(sizeof(uint64_t)), uint64_t{0});
        MPI_Win_lock_all(0, window_);
        MPI_Win_sync(window_);
        MPI_Barrier(MPI_COMM_WORLD);
    }
    ~MpiPeers() override {
        MPI_Win_unlock_all(window_);
        MPI_Win_free(&window_);
    }

    uint32_t rank() const override { return rank_; }
    uint32_t count() const override { return count_; }
    uint32_t local_count() const override { return local_count_; }

    Result<uint64_t> add(uint32_t number, uint64_t value) override {
        uint64_t before = 0;
        MPI_Fetch_and_op(&value, &before, MPI_UINT64_T, 0, static_cast<MPI_Aint>(number), MPI_SUM, window_);
        MPI_Win_flush(0, window_);
        make_progress();
        return before;
    }

    Status broadcast(std::vector<std::byte>& bytes) override {
        uint64_t size = bytes.size();
        MPI_Bcast(&size, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
        bytes.resize(size);
        for (uint64_t at = 0; at < size; at += most)
            MPI_Bcast(bytes.data() + at, static_cast<int>(std::min(most, size - at)), MPI_BYTE, 0, MPI_COMM_WORLD);
        return {};
    }

    Result<std::vector<std::vector<std::byte>>> gather(std::span<const std::byte> bytes) override {
        const uint64_t size = bytes.size();
        std::vector<uint64_t> sizes(count_);
        MPI_Gather(&size, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
        std::vector<std::vector<std::byte>> all;
        if (rank_ > 0) {
            for (uint64_t at = 0; at < size; at += most)
                MPI_Send(bytes.data() + at, static_cast<int>(std::min(most, size - at)), MPI_BYTE, 0, 0, MPI_COMM_WORLD);
            return all;
        }
        all.emplace_back(bytes.begin(), bytes.end());
        for (uint32_t rank = 1; rank < count_; rank++) {
            std::vector<std::byte>& theirs = all.emplace_back(sizes[rank]);
            for (uint64_t at = 0; at < theirs.size(); at += most)
                MPI_Recv(theirs.data() + at, static_cast<int>(std::min<uint64_t>(most, theirs.size() - at)), MPI_BYTE, static_cast<int>(rank), 0,
                         MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        }
        return all;
    }

    // In a tree: what is added are pixels whose words MPI's own sums do not know.
    Status sum(std::span<uint32_t> words, const Add& add) override {
        std::vector<uint32_t> theirs(words.size());
        const int size = static_cast<int>(words.size());
        for (uint32_t step = 1; step < count_; step *= 2) {
            if (rank_ & step) {
                MPI_Send(words.data(), size, MPI_UINT32_T, static_cast<int>(rank_ - step), 1, MPI_COMM_WORLD);
                return {};
            }
            if (rank_ + step >= count_) continue;
            MPI_Recv(theirs.data(), size, MPI_UINT32_T, static_cast<int>(rank_ + step), 1, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
            add(words, theirs);
        }
        return {};
    }

private:
    static constexpr uint64_t most = uint64_t{1} << 30;  // of one message: MPI counts in int

    // Where the network has no atomics of its own, rank 0 carries out those of others whenever it calls MPI.
    static void make_progress() {
        int there = 0;
        MPI_Iprobe(MPI_ANY_SOURCE, std::numeric_limits<short>::max(), MPI_COMM_WORLD, &there, MPI_STATUS_IGNORE);
    }

    uint32_t rank_ = 0, count_ = 1, local_count_ = 1;
    MPI_Win window_ = MPI_WIN_NULL;
};

// Set by launchers: Open MPI's, MPICH's and others that speak PMI, Slurm's.
bool was_launched() {
    const char* names[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "MPI_LOCALNRANKS"};
    return std::any_of(std::begin(names), std::end(names), [](const char* name) { return std::getenv(name) != nullptr; });
}

}  // namespace

Cluster::Cluster() {
    if (!was_launched()) return;
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    begun_ = true;
    int count = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    if (count > 1) peers_ = std::make_shared<MpiPeers>();
}

Cluster::~Cluster() {
    peers_.reset();
    if (begun_) MPI_Finalize();
}

int Cluster::end(int exit_status) {
    if (peers_ && exit_status != 0) MPI_Abort(MPI_COMM_WORLD, exit_status);
    return exit_status;
}

}  // namespace raypager
