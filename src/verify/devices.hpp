// Every device in a process of its own: one that crashes or hangs costs a row, not the run.
#pragma once

#include <functional>
#include <string>

#include "verify/results.hpp"
#include "verify/run.hpp"

namespace meniscus::verify {

/// An item that begins: its number from 1 on, how many there are, and its name.
struct Step {
  std::string device;
  std::size_t item = 0, items = 0;
  std::string name;
};
using Watch = std::function<void(const Step&)>;

/// Runs all items on the devices that `selector` names (see select_device; "all": every one).
/// A process that says nothing for `seconds` is ended, and the next one goes on behind the item.
/// Throws DeviceError when there is no such device.
VerifyRun verify_devices(const std::string& selector, const Settings& settings, double seconds,
                         const Watch& watch);

/// What such a process does: tells of the devices that `selector` names, or runs the items from
/// `from` on. Writes lines of JSON to standard output.
void list_as_child(const std::string& selector);
void run_as_child(int device, std::size_t from, const Settings& settings);

}  // namespace meniscus::verify
