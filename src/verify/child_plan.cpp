#include "verify/child_plan.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace meniscus::verify {

using Json = nlohmann::json;

void say(const Json& line) {
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::printf("\n%s%s\n", kMark.data(), text.c_str());
  std::fflush(stdout);
}

std::string to_text(const ChildPlan& plan) {
  Json ended = Json::array();
  for (const Ended& one : plan.ended) ended.push_back({one.kernel, one.launch, one.how});
  const Request& request = plan.request;
  return Json{{"device", plan.device},
              {"from", plan.from},
              {"waits", plan.waits},
              {"without", plan.without},
              {"without_where_not_required", plan.without_where_not_required},
              {"ended", ended},
              {"output", plan.output},
              {"full", request.full},
              {"kernels", request.kernels},
              {"repeat", request.repeat},
              {"reproducers", request.reproducers},
              {"program", request.program},
              {"manifest", request.manifest}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

ChildPlan plan_of(const std::string& text) {
  const Json json = Json::parse(text);
  ChildPlan plan;
  plan.device = json.at("device");
  plan.from = json.at("from");
  plan.waits = json.at("waits");
  plan.without = json.at("without");
  plan.without_where_not_required = json.at("without_where_not_required");
  for (const Json& one : json.at("ended")) plan.ended.push_back({one.at(0), one.at(1), one.at(2)});
  plan.output = json.at("output");
  plan.request.full = json.at("full");
  plan.request.kernels = json.at("kernels");
  plan.request.repeat = json.at("repeat");
  plan.request.reproducers = json.at("reproducers");
  plan.request.program = json.at("program");
  plan.request.manifest = json.at("manifest");
  return plan;
}

}  // namespace meniscus::verify
