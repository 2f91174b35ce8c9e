// A benchmark run that was never measured.
#pragma once

#include "kernels/results.hpp"

namespace meniscus::bench {

inline Result made_up_result(const std::string& kernel, const std::string& variant,
                             std::vector<double> ms, long long particles = 1000) {
  Result result;
  result.kernel = kernel;
  result.variant = variant;
  result.particles = particles;
  result.width = 64;
  result.height = 48;
  result.unit = "particles";
  result.items = static_cast<double>(particles);
  result.bytes = 1e6;
  result.operations = 2e6;
  result.ms = std::move(ms);
  return result;
}

inline Session made_up_session(int threads) {
  Session session;
  session.device = "A <fast> & good device";
  session.kind = "CPU";
  session.platform = "Platform";
  session.driver = "1.2";
  session.compute_units = static_cast<unsigned>(threads);
  session.processors = 2;
  session.threads = threads;
  session.other_work = 0.1;
  session.native_flags = true;
  const double gflops = 50.0 * threads;
  session.roofline = {{{1e5, 50.0}, {1e8, 10.0}}, gflops, 0.9 * gflops, 12.0, 1.5, 1.0, 0.4, 0.1};
  return session;
}

/// Two sessions. "quick": 1 ms a launch, .9 of its native version on each number of threads;
/// "slow": 4 ms, .5; "lonely": no native version.
inline BenchRun made_up_run() {
  BenchRun run{"1.2.3", {}};
  for (const int threads : {2, 1}) {
    Session session = made_up_session(threads);
    session.results = {made_up_result("quick", kDevice, {1.1, 1.0, 1.3, 1.4}),
                       made_up_result("quick", kNative, {0.9, 0.95, 1.2}),
                       made_up_result("slow", kDevice, {4.0, 4.4, 5.0}),
                       made_up_result("slow", kNative, {2.0, 2.2, 2.5}),
                       made_up_result("slow", kDevice, {9.0}, 4000),
                       made_up_result("slow", kNative, {4.5}, 4000),
                       made_up_result("lonely", kDevice, {2.0, 2.0})};
    run.sessions.push_back(session);
  }
  return run;
}

}  // namespace meniscus::bench
