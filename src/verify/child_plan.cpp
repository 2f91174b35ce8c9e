#include "verify/child_plan.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace meniscus::verify {

using Json = nlohmann::json;

// A plan as JSON and back, member by member.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Request, selector, full, kernels, repeat, reproducers, program,
                                   manifest, seconds)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Ended, kernel, launch, how)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ChildPlan, device, from, waits, without,
                                   without_where_not_required, ended, output, request)

void say(const Json& line) {
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::printf("\n%s%s\n", kMark.data(), text.c_str());
  std::fflush(stdout);
}

std::string to_text(const ChildPlan& plan) {
  return Json(plan).dump(-1, ' ', false, Json::error_handler_t::replace);
}

ChildPlan plan_of(const std::string& text) { return Json::parse(text).get<ChildPlan>(); }

}  // namespace meniscus::verify
