// `bench` in a build without Google Benchmark.
#include "meniscus/error.hpp"
#include "program/cli/bench_command.hpp"

namespace meniscus::cli {

void bench_kernels(const BenchOptions&) {
  throw Error(
      "bench: this program was built without Google Benchmark; install libbenchmark-dev and build "
      "it again");
}

}  // namespace meniscus::cli
