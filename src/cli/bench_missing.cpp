// `bench` in a build without Google Benchmark.
#include "cli/bench_command.hpp"
#include "meniscus/error.hpp"

namespace meniscus::cli {

void bench_kernels(const BenchOptions&) {
  throw Error(
      "bench: this program was built without Google Benchmark; install libbenchmark-dev and build "
      "it again");
}

}  // namespace meniscus::cli
