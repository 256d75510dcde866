// A rank that begins as the program does, and then answers nobody: as one that is stopped, or hangs.
#include <mpi.h>
#include <unistd.h>

int main() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm local = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &local);
    MPI_Comm_free(&local);
    for (;;) pause();
}
