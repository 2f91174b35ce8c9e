// The checks of one device, item by item.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "verify/repro.hpp"
#include "verify/row.hpp"

namespace meniscus::verify {

struct Settings {
  bool full = true;                    // else what a simulator has the time for
  std::vector<std::string> kernels;    // parts of names; empty: all
  int repeat = 1;                      // launches and frames are run so often, for the same bits
  Reproducers* reproducers = nullptr;  // of launches that fail
};

/// A part of the run that can fail or crash without the others.
struct Item {
  std::string group;          // of its rows: "kernel"
  std::string name;           // "kernels of fit on block, width 8"
  std::string variant, size;  // of its rows, where they are the same; may be empty
  bool required = true;       // whether its failure makes the device fail
  std::function<void(Device&, const Report&)> run;
};

/// The items, the same ones in the same order for the same settings. `device_width` is the vector
/// width that the device is used with: only that must pass.
std::vector<Item> items_of(const Settings& settings, int device_width);

/// A row that says of a whole item, or of a kernel in it, what its own rows could not.
Row row_of(const Item& item, const std::string& kernel, Result result, const std::string& reason);

/// Runs an item: what it throws becomes a row.
void run_item(const Item& item, Device& device, const Report& report);

/// Every kernel that some canonical trace holds.
std::vector<std::string> known_kernels();

}  // namespace meniscus::verify
