// Every device in a process of its own: one that crashes or hangs costs a row, not the run.
#pragma once

#include <functional>
#include <string>

#include "verify/results.hpp"
#include "verify/run.hpp"

namespace meniscus::verify {

/// What is verified, as the user asks for it.
struct Request {
  std::string selector = "all";      // devices, see select_device; "all": every one
  bool full = true;                  // else what a simulator has the time for
  std::vector<std::string> kernels;  // parts of names; empty: all
  int repeat = 1;                    // runs of each launch and frame
  std::string reproducers;           // the folder that they go into; empty: none are made
  std::string program, manifest;     // a kernel of others instead of ours; may be empty
  double seconds = 300;              // without a sign of life, until a process is ended; while a
                                     // kernel is built, at least a minute
};

/// An item that begins: its number from 1 on, how many there are, and its name.
struct Step {
  std::string device;
  int number = -1;  // of the device, where another one has its name
  std::size_t item = 0, items = 0;
  std::string name;
};

/// Is told what happens.
struct Watch {
  std::function<void(const Step&)> step;
  std::function<void(const Row&)> failed;  // at once; of a kernel and variant the first failure
  std::function<int()> stop;               // the signal that asks to stop; 0: none yet
};

/// Runs all items on the devices, each in a process of its own. A process that crashes, or says
/// nothing for too long, costs a row that names the kernel; the others of the same case go on
/// without that kernel in another process, and after two such failures all cases do.
/// When `stop` asks for it, the process under way is ended within a tenth of a second. The run then
/// has what was found before, and says of each device what was not run.
/// Throws DeviceError when there is no such device, and InputError for what is wrong with a program
/// or its manifest.
VerifyRun verify_devices(const Request& request, const Watch& watch);

}  // namespace meniscus::verify
