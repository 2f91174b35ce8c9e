// A file that appears under its name only when it is complete and on disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus {

/// Writes to a unique temporary name in the target's folder; `publish` renames it to the target. A
/// symbolic link is followed, so that the link stays and its file changes or is made. A file that
/// is replaced gives its mode to the new one, and is left alone where it is read-only. Every
/// function throws OutputError that names the target, the reason and what to do; after one failure
/// all later calls fail with the same message. A full disk is an error here; for the limit on a
/// file's size (RLIMIT_FSIZE) to be one too, the program must ignore SIGXFSZ.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();  // removes the temporary file unless it was committed
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t size) {
    if (size > room_) return write_beyond(static_cast<const char*>(data), size);
    std::memcpy(buffer_.data() + used(), data, size);
    room_ -= size;
  }
  void write(std::string_view text) { write(text.data(), text.size()); }

  const std::string& path() const { return path_; }

  /// The place in the file where the next write goes, in bytes from its start.
  std::uint64_t position() const { return written_ + used(); }
  void seek(std::uint64_t position);

  /// Reads what was written from `position` on: up to `size` bytes, fewer where the file ends.
  std::size_t read(std::uint64_t position, void* data, std::size_t size);

  /// Flushes and waits until the data are on disk. Call once, after the last write.
  void finish();

  /// Renames the finished file to the target. Of several files, finish all before publishing one.
  void publish();

  void commit() {
    finish();
    publish();
  }

 private:
  std::size_t used() const { return buffer_.size() - room_; }
  void write_beyond(const char* bytes, std::size_t size);
  void check();
  void flush();
  [[noreturn]] void fail(int error);

  std::string path_;    // as the caller named it
  std::string target_;  // path_ with links followed
  std::string temporary_;
  std::string failure_;  // the first error; empty: none so far
  std::vector<char> buffer_;
  std::size_t room_ = 0;       // bytes at the buffer's end that are free; none after a failure
  std::uint64_t written_ = 0;  // offset of the buffer's first byte in the file
  int descriptor_ = -1;
  int slot_ = -1;  // in the registry of pending files
};

/// Where a path leads, its last name no longer a symbolic link: the one rule for all that is
/// written. Throws OutputError where links lead in a circle, and for a link of another user in a
/// folder that is open to everyone, such as /tmp.
std::string behind_links(const std::string& path);

/// The message of an error of the system (errno): the file, the reason and what to do.
std::string cannot_be_written(const std::string& path, int error);

/// Removes temporary files in the folder of `path` that nobody writes any more, because their
/// process was killed: those of this machine that are not locked, those of others when they have
/// not been written for an hour either, since not every shared file system shares its locks.
void remove_abandoned_outputs(const std::string& path);

/// Removes the temporary files of all OutputFiles that are not committed, for the process to end:
/// who makes another one waits for ever. Async-signal-safe.
void remove_pending_outputs() noexcept;

}  // namespace meniscus
