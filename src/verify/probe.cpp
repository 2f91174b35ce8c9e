#include "verify/probe.hpp"

#include <chrono>
#include <exception>

#include "base/elapsed.hpp"
#include "program/wording.hpp"

namespace meniscus::verify {

void report_probe(Row row, const std::function<Finding()>& probe, const Report& report) {
  const auto begin = std::chrono::steady_clock::now();
  Finding finding;
  try {
    finding = probe();
  } catch (const std::exception& error) {
    finding = failed(words_of(error));
  }
  row.ms = milliseconds_since(begin);
  row.result = finding.result;
  row.required = row.required && finding.result != Result::skip;
  row.reason = finding.reason;
  row.ulp = finding.ulp;
  report(std::move(row));
}

}  // namespace meniscus::verify
