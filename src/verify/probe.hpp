// How a probe becomes a row: timed, and failed by what it throws.
#pragma once

#include <string>

#include "verify/row.hpp"

namespace meniscus::verify {

/// What a probe found out.
struct Finding {
  Result result = Result::pass;
  std::string reason;
  double ulp = -1;
};

inline Finding failed(std::string reason, double ulp = -1) {
  return {Result::fail, std::move(reason), ulp};
}
inline Finding skipped(std::string reason) { return {Result::skip, std::move(reason), -1}; }

/// Runs a probe and tells its row, which says everything but the finding and the time. What the
/// probe throws is its failure, not the caller's; what was skipped is not required.
void report_probe(Row row, const std::function<Finding()>& probe, const Report& report);

}  // namespace meniscus::verify
