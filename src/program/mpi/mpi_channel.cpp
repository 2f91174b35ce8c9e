// A channel over MPI: the only file that names it. Built as a module that is loaded where mpirun or
// srun started the program (launch.hpp), so that no other start pays for it.
#include <mpi.h>
#include <unistd.h>

#include <chrono>

#include "base/team.hpp"

namespace meniscus {
namespace {

class MpiChannel : public Channel {
 public:
  MpiChannel() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
  }
  ~MpiChannel() override { MPI_Finalize(); }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  // With one value ranks wait for each other, for as long as the slowest works: asleep, as MPI
  // itself would keep a processor busy.
  void minimum(std::uint32_t* values, std::size_t count) override {
    if (count > 1) {
      MPI_Allreduce(MPI_IN_PLACE, values, static_cast<int>(count), MPI_UINT32_T, MPI_MIN,
                    MPI_COMM_WORLD);
      return;
    }
    MPI_Request request;
    MPI_Iallreduce(MPI_IN_PLACE, values, 1, MPI_UINT32_T, MPI_MIN, MPI_COMM_WORLD, &request);
    const auto begin = std::chrono::steady_clock::now();
    for (int done = 0;;) {
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      if (done) return;
      if (std::chrono::steady_clock::now() - begin > std::chrono::microseconds(200)) usleep(50);
    }
  }
  void sum(std::int64_t* values, std::size_t count) override {
    MPI_Allreduce(MPI_IN_PLACE, values, static_cast<int>(count), MPI_INT64_T, MPI_SUM,
                  MPI_COMM_WORLD);
  }
  void broadcast(void* bytes, std::size_t size, int from) override {
    MPI_Bcast(bytes, static_cast<int>(size), MPI_BYTE, from, MPI_COMM_WORLD);
  }
  void send(const void* bytes, std::size_t size, int to) override {
    MPI_Send(bytes, static_cast<int>(size), MPI_BYTE, to, 0, MPI_COMM_WORLD);
  }
  void receive(void* bytes, std::size_t size, int from) override {
    MPI_Recv(bytes, static_cast<int>(size), MPI_BYTE, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  }

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace
}  // namespace meniscus

extern "C" meniscus::Channel* meniscus_open_channel() { return new meniscus::MpiChannel; }
