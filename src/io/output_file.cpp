#include "io/output_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>

#include "base/host_name.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 20;

// The registry of temporary names. A signal handler may read it at any moment: a slot is `taken`
// before its name is whole, `making` before its file is there for certain, and `pending` then.
// Files beyond the last slot are written all the same; only a signal leaves them behind.
enum SlotState : int { kFree, kTaken, kMaking, kPending };
struct Slot {
  std::atomic<int> state{kFree};
  char name[PATH_MAX];
};
static_assert(std::atomic<int>::is_always_lock_free, "the signal handler must not wait");
std::array<Slot, 64> slots;
std::atomic<bool> ending{false};  // the files are being removed, for the process ends

int take_slot(const std::string& name) {
  if (name.size() >= PATH_MAX) return -1;
  for (std::size_t k = 0; k < slots.size(); ++k) {
    int expected = kFree;
    if (!slots[k].state.compare_exchange_strong(expected, kTaken)) continue;
    std::memcpy(slots[k].name, name.c_str(), name.size() + 1);
    slots[k].state = kMaking;
    return static_cast<int>(k);
  }
  return -1;
}

void set_state(int slot, SlotState state) {
  if (slot >= 0) slots[static_cast<std::size_t>(slot)].state = state;
}

// A file that is made when the others are gone already would be left behind.
[[noreturn]] void wait_for_the_end(int slot) {
  set_state(slot, kFree);
  for (;;) pause();
}

std::uint64_t random_bits() {
  std::uint64_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != sizeof bits)
    bits = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  return bits;
}

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

// ".meniscus-HOST-": what temporary files of this machine begin with.
std::string own_prefix() {
  std::string name = host_name();
  for (char& c : name)
    if (c == '/') c = '_';
  return ".meniscus-" + name + "-";
}

// Whether this process holds the file's lock and the file still has its name. A file system without
// locks counts as locked.
bool lock(int descriptor) {
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return false;
  struct stat status {};
  return fstat(descriptor, &status) == 0 && status.st_nlink > 0;
}

// What the user can do about an error.
std::string advice(int error, const std::string& folder) {
  switch (error) {
    case ENOENT:
      // Such as /proc, in which nobody makes files.
      if (std::error_code unknown; std::filesystem::is_directory(folder, unknown))
        return "no file can be made in " + folder + "; choose another folder";
      return "make the folder " + folder + " first";
    case ENOTDIR:
      return folder + " is not a folder; choose another one";
    case EISDIR:
      return "give the name of a file";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a folder that you may write to";
    case ENOSPC:
    case EDQUOT:
      return "free some space or choose another disk";
    case EFBIG:
      return "raise the limit on the size of files, ulimit -f";
    case ELOOP:
      return "remove the symbolic links that lead in a circle, or choose another name";
    case ENAMETOOLONG:
      return "choose a shorter name";
    case EMFILE:
    case ENFILE:
      return "raise the limit on open files, ulimit -n";
    default:
      return "check the folder " + folder + " and its disk";
  }
}

// Whether a link is not another user's bait: in a folder where everyone may make files and nobody
// may remove those of others, its owner is this user or the folder's. Linux's protected_symlinks
// asks the same of those who open the link; a rename to where it leads would pass it by.
bool may_follow(const struct stat& link, const std::string& path) {
  constexpr mode_t kShared = S_ISVTX | S_IWOTH;
  struct stat folder {};
  return link.st_uid == geteuid() ||
         (stat(folder_of(path).c_str(), &folder) == 0 &&
          ((folder.st_mode & kShared) != kShared || folder.st_uid == link.st_uid));
}

// Whether a file that is there may be replaced by this user.
bool may_replace(const struct stat& file, const std::string& path) {
  if ((file.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0) return false;
  return faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0 || errno != EACCES;
}

}  // namespace

std::string behind_links(const std::string& path) {
  constexpr int kMostLinks = 40;  // as Linux
  std::string target = path;
  for (int links = 0;; ++links) {
    struct stat status {};
    if (lstat(target.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) return target;
    if (links == kMostLinks) throw OutputError(cannot_be_written(path, ELOOP));
    if (!may_follow(status, target))
      throw OutputError(path + ": cannot be written: it is a symbolic link of another user in " +
                        folder_of(target) + ", where everyone may make one (choose another name)");
    std::error_code error;
    const std::filesystem::path next = std::filesystem::read_symlink(target, error);
    if (error) throw OutputError(cannot_be_written(path, error.value()));
    target = (std::filesystem::path(folder_of(target)) / next).string();
  }
}

std::string cannot_be_written(const std::string& path, int error) {
  return path + ": cannot be written: " + std::generic_category().message(error) + " (" +
         advice(error, folder_of(path)) + ")";
}

OutputFile::OutputFile(const std::string& path) : path_(path), target_(behind_links(path)) {
  std::optional<mode_t> kept;  // the mode of a file of this user's that is replaced
  struct stat status {};
  if (stat(target_.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) fail(EISDIR);
    const auto refuse = [&](const char* why) {
      failure_ = path_ + ": cannot be written: " + why;
      check();
    };
    if (!S_ISREG(status.st_mode)) refuse("not a regular file (choose another name)");
    if (!may_replace(status, target_))
      refuse("the file that is there is read-only (chmod u+w it, or choose another name)");
    if (status.st_uid == geteuid()) kept = status.st_mode & (S_IRWXU | S_IRWXG | S_IRWXO);
  }
  if (target_.empty() || target_.back() == '/') fail(target_.empty() ? ENOENT : EISDIR);
  const std::string folder = folder_of(target_);
  // Before there is a file: where memory ends, no destructor removes it.
  buffer_.resize(kBufferSize);
  room_ = kBufferSize;
  for (int attempt = 0; descriptor_ < 0; ++attempt) {
    char number[64];
    std::snprintf(number, sizeof number, "%ld-%016llx.tmp", static_cast<long>(getpid()),
                  static_cast<unsigned long long>(random_bits()));
    temporary_ = folder + "/" + own_prefix() + number;
    slot_ = take_slot(temporary_);
    if (ending) wait_for_the_end(slot_);
    descriptor_ =
        open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, kept.value_or(0666));
    if (descriptor_ >= 0) set_state(slot_, kPending);
    // The lock says that the file is in use, see remove_abandoned_outputs().
    if (descriptor_ >= 0 && lock(descriptor_)) break;
    const int error = descriptor_ >= 0 ? EEXIST : errno;
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = -1;
    set_state(slot_, kFree);
    slot_ = -1;
    if (error != EEXIST || attempt == 16) fail(error);
  }
  if (kept) fchmod(descriptor_, *kept);  // what umask took; not all file systems have modes
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) close(descriptor_);
  if (!temporary_.empty()) unlink(temporary_.c_str());
  set_state(slot_, kFree);
}

void OutputFile::write_beyond(const char* bytes, std::size_t size) {
  while (size > 0) {
    if (room_ == 0) flush();
    const std::size_t part = std::min(size, room_);
    std::memcpy(buffer_.data() + used(), bytes, part);
    room_ -= part;
    bytes += part;
    size -= part;
  }
}

void OutputFile::seek(std::uint64_t position) {
  flush();
  if (lseek(descriptor_, static_cast<off_t>(position), SEEK_SET) < 0) fail(errno);
  written_ = position;
}

std::size_t OutputFile::read(std::uint64_t position, void* data, std::size_t size) {
  flush();
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = pread(descriptor_, static_cast<char*>(data) + done, size - done,
                            static_cast<off_t>(position + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(errno);
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

void OutputFile::finish() {
  flush();
  if (fsync(descriptor_) != 0) fail(errno);
}

void OutputFile::publish() {
  check();
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
  temporary_.clear();
  close(descriptor_);  // with its lock; finish() has seen what could be wrong with the data
  descriptor_ = -1;
}

void OutputFile::check() {
  if (!failure_.empty()) throw OutputError(failure_);
}

void OutputFile::flush() {
  check();
  const std::size_t size = used();
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = ::write(descriptor_, buffer_.data() + done, size - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(n < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(n);
  }
  written_ += size;
  room_ = kBufferSize;
}

void OutputFile::fail(int error) {
  failure_ = cannot_be_written(path_, error);
  room_ = 0;
  throw OutputError(failure_);
}

void remove_abandoned_outputs(const std::string& path) {
  constexpr auto kForeign = std::chrono::hours(1);
  const std::string prefix = own_prefix();
  std::error_code error;
  const auto now = std::filesystem::file_time_type::clock::now();
  for (std::filesystem::directory_iterator entry(folder_of(path), error), end;
       !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(".meniscus-") || !name.ends_with(".tmp")) continue;
    if (!name.starts_with(prefix)) {
      std::error_code gone;
      const auto written = entry->last_write_time(gone);
      if (gone || now - written < kForeign) continue;
    }
    const int descriptor =
        open(entry->path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) continue;
    if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) unlink(entry->path().c_str());
    close(descriptor);
  }
}

void remove_pending_outputs() noexcept {
  ending = true;
  for (Slot& slot : slots) {
    // A file that is being made is there in a moment, but for one of the thread that this has
    // interrupted, or on a disk that hangs.
    const auto is_making = [&] { return slot.state == kTaken || slot.state == kMaking; };
    constexpr timespec kMoment{0, 1'000'000};
    for (int waited = 0; is_making() && waited < 500; ++waited) nanosleep(&kMoment, nullptr);
    if (slot.state >= kMaking) unlink(slot.name);
  }
}

}  // namespace meniscus
