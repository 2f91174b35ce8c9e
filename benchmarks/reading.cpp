// How fast files of particles are read: as a whole into memory, and in chunks as frames that
// stream.
//   meniscus_reading_bench FILE ...
// Prints the file's bytes over processor time, which other processes on the machine change little,
// and over wall time. Each file is read once before, so that it is in the page cache.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <vector>

#include "meniscus/io.hpp"
#include "meniscus/source.hpp"

namespace {

struct Clocks {
  double processor = 0, wall = 0;  // seconds
};

Clocks now() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  const auto wall = std::chrono::steady_clock::now().time_since_epoch();
  return {static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec),
          std::chrono::duration<double>(wall).count()};
}

void report(const char* path, const char* how, const Clocks& begin) {
  const Clocks end = now();
  const double gigabytes = static_cast<double>(std::filesystem::file_size(path)) * 1e-9;
  std::printf("%-28s %-7s %.2f GB  %.2f GB/s of processor time  %.2f GB/s\n", path, how, gigabytes,
              gigabytes / (end.processor - begin.processor), gigabytes / (end.wall - begin.wall));
}

}  // namespace

int main(int count, char** paths) {
  constexpr int kRounds = 3;
  constexpr std::size_t kChunk = std::size_t{1} << 20;
  std::vector<std::vector<float>> values(6, std::vector<float>(kChunk));
  for (int round = 0; round < kRounds; ++round)
    for (int k = 1; k < count; ++k) {
      Clocks begin = now();
      const std::size_t particles = meniscus::read_particles(paths[k]).size();
      if (round > 0) report(paths[k], "whole", begin);
      const auto source = meniscus::open_particles(paths[k]);
      if (source->in_memory()) continue;
      begin = now();
      for (std::size_t first = 0; first < particles; first += kChunk)
        source->read(static_cast<std::int64_t>(first), std::min(kChunk, particles - first),
                     {values[0].data(), values[1].data(), values[2].data(), values[3].data(),
                      values[4].data(), values[5].data()});
      if (round > 0) report(paths[k], "chunks", begin);
    }
}
