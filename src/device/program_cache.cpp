#include "device/program_cache.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <vector>

#include "base/content_hash.hpp"
#include "io/output_file.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".program";
constexpr std::uint64_t kMost = std::uint64_t{256} << 20;  // bytes of all entries

// Whether a folder is this user's or the administrator's, and nobody else may write into it: what
// is found there runs.
bool is_trusted(const std::string& folder) {
  struct stat status {};
  return stat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) &&
         (status.st_uid == geteuid() || status.st_uid == 0) &&
         (status.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

std::string path_of(const std::string& key) {
  const std::string folder = program_cache_folder();
  return folder.empty() ? "" : folder + "/" + hex_digits(content_hash(key)) + kEnding;
}

// What an entry begins with: that it is one, the hash of all that follows, and how long the key is.
std::string head_of(const std::string& key, const std::string& content) {
  return "meniscus program 1\n" + hex_digits(content_hash(content)) + "\n" +
         std::to_string(key.size()) + "\n";
}

void make_room(const std::string& folder) {
  struct Entry {
    fs::path path;
    fs::file_time_type used;
    std::uint64_t size;
  };
  std::vector<Entry> entries;
  std::uint64_t all = 0;
  std::error_code error, gone;  // others may remove entries, too
  for (fs::directory_iterator found(folder, error), end; !error && found != end;
       found.increment(error)) {
    if (found->path().extension() != kEnding) continue;
    Entry entry{found->path(), found->last_write_time(gone), found->file_size(gone)};
    if (gone) continue;
    all += entry.size;
    entries.push_back(std::move(entry));
  }
  if (all <= kMost) return;
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.used < b.used; });
  for (const Entry& entry : entries) {
    if (all <= kMost / 2) break;
    fs::remove(entry.path, gone);
    all -= entry.size;
  }
}

}  // namespace

std::string identity_of(const DeviceInfo& info) {
  std::string text;
  for (const std::string& part : {info.platform, info.vendor, info.name, info.version, info.driver})
    text += part + "\n";
  return text;
}

std::string program_cache_folder() {
  const auto set = [](const char* name) -> std::string {
    const char* const value = std::getenv(name);
    return value ? value : "";
  };
  if (const std::string chosen = set("MENISCUS_CACHE_DIR"); !chosen.empty()) return chosen;
  if (const std::string cache = set("XDG_CACHE_HOME"); !cache.empty()) return cache + "/meniscus";
  if (const std::string home = set("HOME"); !home.empty()) return home + "/.cache/meniscus";
  return "";
}

bool keeps_programs(const std::string& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored))
    return is_trusted(folder) && access(folder.c_str(), W_OK | X_OK) == 0;
  fs::path above = fs::absolute(folder);  // in which it will be made
  while (above.has_relative_path() && !fs::exists(above, ignored)) above = above.parent_path();
  return fs::is_directory(above, ignored) && access(above.c_str(), W_OK | X_OK) == 0;
}

std::string find_program(const std::string& key) {
  const std::string path = path_of(key);
  if (path.empty() || !is_trusted(program_cache_folder())) return "";
  std::ifstream file(path, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  const std::size_t head = head_of(key, "").size();
  if (bytes.size() <= head + key.size()) return "";
  const std::string content = bytes.substr(head);
  if (!bytes.starts_with(head_of(key, content)) || !content.starts_with(key)) return "";
  std::error_code ignored;
  fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);  // when it was last used
  return content.substr(key.size());
}

void keep_program(const std::string& key, const std::string& binary) noexcept {
  try {
    const std::string path = path_of(key);
    if (path.empty() || binary.empty()) return;
    const std::string folder = program_cache_folder();
    const fs::path bare = (fs::absolute(folder) / "").parent_path();  // without a / at its end
    fs::create_directories(bare.parent_path());
    mkdir(bare.c_str(), S_IRWXU);
    if (!is_trusted(folder)) return;
    remove_abandoned_outputs(path);
    make_room(folder);
    const std::string content = key + binary;
    OutputFile file(path);
    file.write(head_of(key, content));
    file.write(content);
    file.commit();
  } catch (const std::exception&) {
    // The next start builds it again.
  }
}

void drop_program(const std::string& key) noexcept {
  try {
    std::error_code ignored;
    if (const std::string path = path_of(key); !path.empty()) fs::remove(path, ignored);
  } catch (const std::exception&) {
    // It is replaced by the next one that is kept.
  }
}

}  // namespace meniscus
