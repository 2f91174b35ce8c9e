#include "verify/child.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "meniscus/device.hpp"
#include "meniscus/error.hpp"
#include "program/wording.hpp"
#include "verify/child_plan.hpp"
#include "verify/program.hpp"

namespace meniscus::verify {
namespace {

// Tells the parent what begins, and leaves out what ended processes before.
class Guard : public LaunchGuard {
 public:
  explicit Guard(const ChildPlan& plan) : plan_(plan) {}

  void begin_item(const Item& item, const std::vector<Ended>& ended) {
    launches_ = 0;
    ended_ = ended;
    without_ = item.required ? plan_.without : plan_.without_where_not_required;
  }
  bool allows(const std::string& kernel) override {
    const std::size_t launch = launches_++;
    for (const Ended& ended : ended_)
      if (ended.kernel == kernel && launch >= ended.launch) return false;
    return !without_.contains(kernel);
  }
  void begins(const std::string& kernel, const char* doing, bool alone) override {
    say({{"kernel", kernel}, {"doing", doing}, {"launch", launches_ - 1}, {"alone", alone}});
  }
  void ended() override { say({{"kernel", ""}, {"doing", ""}, {"launch", 0}, {"alone", true}}); }
  bool waits() const override { return plan_.waits; }

 private:
  const ChildPlan& plan_;
  std::set<std::string> without_;
  std::vector<Ended> ended_;
  std::size_t launches_ = 0;  // of the item, so far
};

// The other devices, opened when they are asked for.
OtherDevices others_than(int own) {
  auto opened = std::make_shared<std::vector<std::unique_ptr<Device>>>();
  std::vector<DeviceInfo> infos;
  for (const DeviceInfo& info : list_devices())
    if (info.usable && info.index != own) infos.push_back(info);
  return [opened, infos](std::size_t k) -> Device* {
    while (opened->size() <= k && opened->size() < infos.size())
      opened->push_back(std::make_unique<Device>(infos[opened->size()]));
    return k < opened->size() ? (*opened)[k].get() : nullptr;
  };
}

void write_all(int to, const Bytes& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::write(to, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno != EINTR)
      throw Error(std::string("what the kernel left cannot be handed on: ") + std::strerror(errno) +
                  " (name another folder in TMPDIR)");
    done += static_cast<std::size_t>(std::max<ssize_t>(0, count));
  }
}

Item item_of_program(const ChildPlan& plan) {
  return {
      "program", plan.request.program, "", "", true, [plan](Device& device, const Report& report) {
        const Program program = read_program(plan.request.program, plan.request.manifest);
        write_all(plan.output, joined(run_program(device, program, "program", report)));
      }};
}

std::vector<Item> items_of_plan(const ChildPlan& plan, Reproducers* reproducers, int device_width) {
  const Request& request = plan.request;
  if (!request.program.empty()) return {item_of_program(plan)};
  return items_of({request.full, request.kernels, request.repeat, reproducers}, device_width);
}

// Runs the items of a plan from the one on that it begins with, and ends the process.
void run_items(const ChildPlan& plan, Device& device, Guard& guard) {
  std::optional<Reproducers> reproducers;
  if (!plan.request.reproducers.empty())
    reproducers.emplace(plan.request.reproducers, device.info(), others_than(plan.device));
  const std::vector<Item> items =
      items_of_plan(plan, reproducers ? &*reproducers : nullptr, device.state().vector_width);
  std::vector<std::string> groups;
  for (const Item& item : items) groups.push_back(item.group);
  say({{"plan", groups}});
  for (std::size_t k = plan.from; k < items.size(); ++k) {
    const Item& item = items[k];
    say({{"item", k},
         {"items", items.size()},
         {"name", item.name},
         {"group", item.group},
         {"variant", item.variant},
         {"size", item.size},
         {"required", item.required}});
    const std::vector<Ended> ended = k == plan.from ? plan.ended : std::vector<Ended>{};
    guard.begin_item(item, ended);
    if (reproducers) {
      std::map<std::string, std::string> how;
      for (const Ended& one : ended) how[one.kernel] = one.how;
      reproducers->set_ended(std::move(how));
    }
    run_item(item, device, [](const Row& row) { say({{"row", to_json(row)}}); });
  }
  say({{"end", true}});
  // Some drivers crash when they are let go of; all has been said.
  std::_Exit(0);
}

}  // namespace

void list_as_child(const std::string& selector) {
  try {
    const std::vector<DeviceInfo> devices =
        selector == "all" ? list_devices() : std::vector{select_device(selector)};
    if (devices.empty()) select_device("");  // throws, and says why there is none
    for (const DeviceInfo& device : devices)
      say({{"index", device.index},
           {"name", device.name},
           {"platform", device.platform},
           {"driver", device.driver},
           {"version", device.version},
           {"problem", device.problem}});
    say({{"end", true}});
  } catch (const Error& error) {
    say({{"error", words_of(error)}});
  }
}

void run_as_child(const std::string& text) {
  try {
    const ChildPlan plan = plan_of(text);
    Device device(std::to_string(plan.device));
    Guard guard(plan);
    device.state().guard = &guard;
    run_items(plan, device, guard);
  } catch (const std::exception& error) {
    say({{"error", words_of(error)}});
  }
}

}  // namespace meniscus::verify
