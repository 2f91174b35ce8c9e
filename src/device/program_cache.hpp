// Built programs on disk, for runtimes that build them anew at every start.
#pragma once

#include <string>

#include "meniscus/device.hpp"

namespace meniscus {

/// What tells a device and its driver from others, a line each, for keys.
std::string identity_of(const DeviceInfo& info);

/// Where entries are: MENISCUS_CACHE_DIR, else meniscus in XDG_CACHE_HOME, else in HOME/.cache.
/// Empty: none of them is set, and nothing is kept. It is made for this user alone; one into which
/// others may write is not used.
std::string program_cache_folder();

/// Whether entries can be kept in that folder, whose name is not empty: where it is there, it is
/// this user's alone, and may be written into; else it can be made.
bool keeps_programs(const std::string& folder);

/// What was kept under `key`, the whole description of what an entry depends on. Empty: nothing, or
/// it is damaged.
std::string find_program(const std::string& key);

/// Keeps a program's binary, in place of what was there; several processes may at once. Entries
/// that were not used for longest go when all take more than 256 MB. Where the folder cannot be
/// written, nothing is kept, and nothing said.
void keep_program(const std::string& key, const std::string& binary) noexcept;

/// Removes an entry, e.g. one that the driver refuses.
void drop_program(const std::string& key) noexcept;

}  // namespace meniscus
