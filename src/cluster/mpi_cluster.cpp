#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <utility>
#include <vector>

#include "cluster/cluster.hpp"
#include "cluster/mpi_thread.hpp"

namespace raypager {
namespace {

// Errors of MPI end all ranks by themselves (MPI_ERRORS_ARE_FATAL), so none comes back from its functions.
class MpiPeers final : public Peers {
public:
    explicit MpiPeers(MpiThread& mpi) : mpi_(mpi) {}

    uint32_t rank() const override { return static_cast<uint32_t>(mpi_.rank()); }
    uint32_t count() const override { return static_cast<uint32_t>(mpi_.count()); }
    uint32_t local_count() const override { return static_cast<uint32_t>(mpi_.local_count()); }
    Result<uint64_t> add(uint32_t number, uint64_t value) override { return mpi_.add(number, value); }
    Status tell(std::vector<std::byte> bytes) override {
        mpi_.tell(std::move(bytes));
        return {};
    }
    std::vector<std::vector<std::byte>> told() const override { return mpi_.told(); }
    void serve(Shelf* shelf) override { mpi_.serve(shelf); }
    Answer get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds, const std::atomic<bool>& stop) override {
        return mpi_.get(rank, number, bytes, seconds, stop);
    }
    Answer put(uint32_t rank, uint64_t number, std::vector<std::byte> bytes, const std::atomic<bool>& stop) override {
        return mpi_.put(rank, number, std::move(bytes), stop);
    }

    Status broadcast(std::vector<std::byte>& bytes) override {
        mpi_.run([&] {
            uint64_t size = bytes.size();
            MPI_Request request = MPI_REQUEST_NULL;
            MPI_Ibcast(&size, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD, &request);
            mpi_.wait(request);
            bytes.resize(size);
            for_pieces(size, [&](uint64_t at, int piece) {
                MPI_Ibcast(bytes.data() + at, piece, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
                mpi_.wait(request);
            });
        });
        return {};
    }

    Result<std::vector<std::vector<std::byte>>> gather(std::span<const std::byte> bytes) override {
        std::vector<std::vector<std::byte>> all;
        mpi_.run([&] {
            const uint64_t size = bytes.size();
            std::vector<uint64_t> sizes(count());
            MPI_Request request = MPI_REQUEST_NULL;
            MPI_Igather(&size, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, 0, MPI_COMM_WORLD, &request);
            mpi_.wait(request);
            if (rank() > 0) return for_pieces(size, [&](uint64_t at, int piece) { send(bytes.data() + at, piece, MPI_BYTE, 0, gather_tag); });
            all.emplace_back(bytes.begin(), bytes.end());
            for (uint32_t from = 1; from < count(); from++) {
                std::vector<std::byte>& theirs = all.emplace_back(sizes[from]);
                for_pieces(theirs.size(), [&](uint64_t at, int piece) { receive(theirs.data() + at, piece, MPI_BYTE, from, gather_tag); });
            }
        });
        return all;
    }

    // In a tree: what is added are pixels whose words MPI's own sums do not know.
    Status sum(std::span<uint32_t> words, const Add& add) override {
        mpi_.run([&] {
            std::vector<uint32_t> theirs(words.size());
            const int size = static_cast<int>(words.size());
            for (uint32_t step = 1; step < count(); step *= 2) {
                if (rank() & step) return send(words.data(), size, MPI_UINT32_T, rank() - step, sum_tag);
                if (rank() + step >= count()) continue;
                receive(theirs.data(), size, MPI_UINT32_T, rank() + step, sum_tag);
                add(words, theirs);
            }
        });
        return {};
    }

private:
    static constexpr int gather_tag = 0, sum_tag = 1;

    // MPI counts in int.
    template <class Act>
    static void for_pieces(uint64_t size, const Act& act) {
        constexpr uint64_t most = uint64_t{1} << 30;
        for (uint64_t at = 0; at < size; at += most) act(at, static_cast<int>(std::min(most, size - at)));
    }

    void send(const void* data, int size, MPI_Datatype type, uint32_t to, int tag) {
        MPI_Request request = MPI_REQUEST_NULL;
        MPI_Isend(data, size, type, static_cast<int>(to), tag, MPI_COMM_WORLD, &request);
        mpi_.wait(request);
    }
    void receive(void* data, int size, MPI_Datatype type, uint32_t from, int tag) {
        MPI_Request request = MPI_REQUEST_NULL;
        MPI_Irecv(data, size, type, static_cast<int>(from), tag, MPI_COMM_WORLD, &request);
        mpi_.wait(request);
    }

    MpiThread& mpi_;
};

// That a launcher has to end a job.
constexpr std::chrono::seconds launcher_time{10};

// Set by launchers: Open MPI's, MPICH's and others that speak PMI, Slurm's.
bool was_launched() {
    const char* names[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "MPI_LOCALNRANKS"};
    return std::any_of(std::begin(names), std::end(names), [](const char* name) { return std::getenv(name) != nullptr; });
}

}  // namespace

// What a handle needs of MPI.
struct Cluster::State {
    MpiThread mpi;
    MpiPeers peers{mpi};
};

Cluster::Cluster() {
    if (was_launched()) state_ = std::make_shared<State>();
}

Cluster::~Cluster() = default;

std::shared_ptr<Peers> Cluster::peers() const {
    return state_ && state_->peers.count() > 1 ? std::shared_ptr<Peers>(state_, &state_->peers) : nullptr;
}

bool Cluster::ends_first(double seconds) { return state_->mpi.add_soon(Peers::common_numbers - 1, 1, seconds).value_or(0) == 0; }

// The launcher ends the others; it may hang as well.
int Cluster::end(int exit_status) {
    if (!peers() || exit_status == 0) return exit_status;
    std::thread([exit_status] {
        std::this_thread::sleep_for(launcher_time);
        std::_Exit(exit_status);
    }).detach();
    state_->mpi.run([exit_status] { MPI_Abort(MPI_COMM_WORLD, exit_status); });
    return exit_status;
}

}  // namespace raypager
