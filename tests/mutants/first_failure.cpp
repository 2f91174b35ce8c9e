// Runs those items of verify that launch some kernels until a row fails, and says which.
//
//   first_failure GROUP[,GROUP ...] [KERNEL ...]
//
// GROUP: kernel, reference, frame or probe. Without kernels: all items of the groups. Small cases
// come first, then references. Standard output has a line for each item before it runs, so that a
// crash has a name: "small" or "large", group and name; and then the rows of the first item that
// fail: "fails", group, kernel, variant and case, reason. Tabs lie between them. Exit code: 0 when
// no row fails, 3 when one does.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "verify/canonical.hpp"
#include "verify/run.hpp"

namespace {

using namespace meniscus;
using namespace meniscus::verify;

// What items_of() leaves out for `kernels`. Rows of all kernels are wanted, whichever is asked for:
// a fault must not show in another one.
std::set<std::string> wanted_items(const std::vector<std::string>& kernels, int width) {
  std::set<std::string> names;
  for (const Item& item : items_of({true, kernels}, width)) names.insert(item.name);
  for (const auto& [key, trace] : shipped_canonical().traces)
    if (key.starts_with("frame ") &&
        std::any_of(trace.begin(), trace.end(), [&](const TracedLaunch& launch) {
          return std::find(kernels.begin(), kernels.end(), launch.kernel) != kernels.end();
        }))
      names.insert(key.substr(0, key.rfind(", width")));
  return names;
}

bool fails(const Item& item, Device& device) {
  bool failed = false;
  run_item(item, device, [&](const Row& row) {
    if (row.result != Result::fail) return;
    failed = true;
    std::string reason = row.reason;
    std::replace_if(
        reason.begin(), reason.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
    std::printf("fails\t%s\t%s\t%s, %s\t%s\n", row.group.c_str(), row.kernel.c_str(),
                row.variant.c_str(), row.size.c_str(), reason.c_str());
  });
  return failed;
}

// Early is what is quick and notices most: small items, then references of all sizes. Row groups of
// other sizes have programs of their own and compute the same, so they come last of each.
struct Planned {
  Item item;
  std::string name;
  bool full;
  int when;
};

std::vector<Planned> plan(const std::set<std::string>& groups,
                          const std::vector<std::string>& kernels, int width) {
  const std::set<std::string> wanted = wanted_items(kernels, width);
  std::vector<Planned> planned;
  std::set<std::string> done;
  for (const bool full : {false, true}) {
    std::map<std::string, int> sizes;  // of a stage have one name; the smallest comes first
    for (const Item& item : items_of({full, {}}, width)) {
      // The references of a stage have all sizes in one item.
      const bool all = full && item.group == "reference";
      const std::string name =
          item.name + ", " + (all ? "all sizes" : "size " + std::to_string(sizes[item.name]++));
      if (!groups.count(item.group) || !done.insert(name).second) continue;
      if (!kernels.empty() && !wanted.count(item.name)) continue;
      const bool other_groups = item.variant.find("groups of") != std::string::npos;
      const bool of_stage = item.name.find("kernels of stage") == 0;  // few kernels are built
      planned.push_back(
          {item, name, full, (full && !all ? 5 : all ? 2 : of_stage ? 0 : 1) + other_groups * 3});
    }
  }
  std::stable_sort(planned.begin(), planned.end(),
                   [](const Planned& a, const Planned& b) { return a.when < b.when; });
  return planned;
}

int run(const std::set<std::string>& groups, const std::vector<std::string>& kernels) {
  Device device;
  for (const Planned& next : plan(groups, kernels, device.state().vector_width)) {
    std::printf("%s\t%s\t%s\n", next.full ? "large" : "small", next.item.group.c_str(),
                next.name.c_str());
    std::fflush(stdout);
    if (fails(next.item, device)) return 3;
  }
  return 0;
}

}  // namespace

int main(int count, char** arguments) try {
  if (count < 2) {
    std::fprintf(stderr, "usage: first_failure GROUP[,GROUP ...] [KERNEL ...]\n");
    return 2;
  }
  std::set<std::string> groups;
  std::istringstream list(arguments[1]);
  for (std::string group; std::getline(list, group, ',');) groups.insert(group);
  return run(groups, {arguments + 2, arguments + count});
} catch (const std::exception& error) {
  std::fprintf(stderr, "first_failure: error: %s\n", error.what());
  return 1;
}
