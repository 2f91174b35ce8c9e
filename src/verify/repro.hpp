// Reproducers: folders that show, without Meniscus, what a launch does wrong.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "verify/saved_launch.hpp"

namespace meniscus::verify {

/// Another device than the one that is verified, by number from 0 on; null: there are no more.
using OtherDevices = std::function<Device*(std::size_t)>;

/// Writes a folder for the first launch of each kernel and variant that fails: the kernel's text,
/// its options, ranges and arguments, buffers before the launch and as they should be after it, a
/// host in C, a Makefile and a README with the verdict.
class Reproducers {
 public:
  /// `others` are asked for the values that a launch should leave where this program has only their
  /// hash.
  Reproducers(std::string folder, const DeviceInfo& device, OtherDevices others);

  /// What the launches that come belong to: "width 8", and "fit on block, 300 particles".
  void set_case(const std::string& variant, const std::string& size);

  /// Kernels that ended an earlier process in the case that comes, and how.
  void set_ended(std::map<std::string, std::string> how) { ended_ = std::move(how); }
  /// Empty: it did not.
  std::string how_it_ended(const std::string& kernel) const;

  /// Whether there is none of this kernel and variant yet.
  bool wants(const std::string& kernel) const;

  /// Writes a folder and returns its path. `where` is the launch in words. The verdict is what
  /// `found`, of each argument, differs in, or else `what`. Nothing half-written appears under the
  /// folder's name. Throws OutputError.
  std::string write(SavedLaunch launch, const std::string& where, const std::vector<Bytes>& found,
                    const std::string& what);

 private:
  std::string name_of(const std::string& kernel) const;

  std::string folder_;
  DeviceInfo device_;
  OtherDevices others_;
  std::string variant_, size_;
  std::map<std::string, std::string> ended_;
  std::set<std::string> written_;
};

/// Makes the folder that reproducers go into. Throws InvalidArgument when it is there and not
/// empty, or no folder, and OutputError when it cannot be made.
void make_folder(const std::string& folder);

/// Removes what was begun in it and not finished, and the folder itself when nothing is left.
/// Returns the names of the reproducers, sorted.
std::vector<std::string> finish_folder(const std::string& folder);

}  // namespace meniscus::verify

namespace meniscus {

/// The text of the file that goes into every reproducer: "host.c" or "Makefile".
std::string_view repro_file(std::string_view name);

}  // namespace meniscus
