#include "io/bytes.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "io/inflate_stream.hpp"

namespace meniscus {
namespace {

class FileBytes : public Bytes {
 public:
  explicit FileBytes(const std::string& path) : path_(path) {
    open_input(path);  // says what is wrong with it
    descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status {};
    if (descriptor_ < 0 || fstat(descriptor_, &status) != 0) {
      const int error = errno;
      if (descriptor_ >= 0) close(descriptor_);
      throw InputError(path + ": cannot be opened: " + std::generic_category().message(error));
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
    posix_fadvise(descriptor_, 0, 0, POSIX_FADV_SEQUENTIAL);
  }
  ~FileBytes() override { close(descriptor_); }
  std::uint64_t size() const override { return size_; }
  const std::string& name() const override { return path_; }
  void read(std::uint64_t at, char* to, std::size_t size) const override {
    while (size > 0) {
      const ssize_t n = pread(descriptor_, to, size, static_cast<off_t>(at));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0)
        fail(*this, byte_place(static_cast<std::size_t>(at)),
             n < 0 ? "cannot be read: " + std::generic_category().message(errno)
                   : "the file ends here, it was longer when it was opened");
      to += n;
      at += static_cast<std::uint64_t>(n);
      size -= static_cast<std::size_t>(n);
    }
  }

 private:
  std::string path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

class TextBytes : public Bytes {
 public:
  explicit TextBytes(const InputFile& file) : file_(&file) {}
  TextBytes(std::string name, std::string bytes)
      : own_{std::move(name), std::move(bytes)}, file_(&own_) {}
  std::uint64_t size() const override { return file_->bytes.size(); }
  const std::string& name() const override { return file_->name; }
  const char* in_memory() const override { return file_->bytes.data(); }
  void read(std::uint64_t at, char* to, std::size_t size) const override {
    if (at > file_->bytes.size() || size > file_->bytes.size() - at)
      fail(*this, byte_place(file_->bytes.size()), "the data ends here (truncated?)");
    std::memcpy(to, file_->bytes.data() + at, size);
  }

 private:
  InputFile own_;
  const InputFile* file_;
};

}  // namespace

std::shared_ptr<const Bytes> bytes_of_file(const std::string& path) {
  return std::make_shared<FileBytes>(path);
}

std::shared_ptr<const Bytes> memory_bytes(const InputFile& file) {
  return std::make_shared<TextBytes>(file);
}

std::shared_ptr<const Bytes> owned_bytes(std::string name, std::string bytes) {
  return std::make_shared<TextBytes>(std::move(name), std::move(bytes));
}

std::string text_at(const Bytes& bytes, std::uint64_t at, std::size_t size) {
  if (at > bytes.size() || size > bytes.size() - at)
    fail(bytes, byte_place(static_cast<std::size_t>(at)),
         "wanted " + std::to_string(size) + " bytes, but there are " +
             std::to_string(bytes.size()) + " in all (truncated?)");
  std::string text(size, '\0');
  bytes.read(at, text.data(), size);
  return text;
}

void fail(const Bytes& bytes, const std::string& place, const std::string& message) {
  throw InputError(bytes.name() + ": " + (place.empty() ? "" : place + ": ") + message);
}

void inflate_to(const std::string& packed, bool raw, char* to, std::size_t unpacked,
                const Bytes& of, const std::string& place) {
  InflateStream stream(raw ? Wrapping::none : Wrapping::zlib, of, place);
  constexpr std::size_t kStep = std::size_t{1} << 30;  // zlib counts in 32 bits
  std::size_t taken = 0, made = 0;
  char beyond = 0;  // room for one byte too many
  for (;;) {
    const std::size_t input = std::min(packed.size() - taken, kStep);
    const std::size_t room = std::min(unpacked - made, kStep);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + taken));
    stream.avail_in = static_cast<uInt>(input);
    stream.next_out = reinterpret_cast<Bytef*>(room > 0 ? to + made : &beyond);
    stream.avail_out = static_cast<uInt>(room > 0 ? room : 1);
    const int status = inflate(&stream, Z_NO_FLUSH);
    const std::size_t out = (room > 0 ? room : 1) - stream.avail_out;
    taken += input - stream.avail_in;
    if (room == 0 && out > 0)
      fail(of, place,
           "its data unpacks to more than the " + std::to_string(unpacked) +
               " bytes that are stated");
    made += out;
    if (status == Z_STREAM_END) break;
    if (status != Z_OK)
      fail(of, place,
           status == Z_BUF_ERROR ? std::string("its packed data is cut off (truncated?)")
                                 : std::string("its packed data is damaged: ") +
                                       (stream.msg ? stream.msg : "unknown"));
  }
  if (made != unpacked)
    fail(of, place,
         "its data unpacks to " + std::to_string(made) + " bytes, wanted " +
             std::to_string(unpacked) + " as is stated");
}

std::string inflated_start(const std::string& packed, std::size_t most, const Bytes& of,
                           const std::string& place) {
  InflateStream stream(Wrapping::none, of, place);
  std::string start(most, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(start.data());
  stream.avail_out = static_cast<uInt>(most);
  const int status = inflate(&stream, Z_NO_FLUSH);
  start.resize(most - stream.avail_out);
  if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
    fail(of, place, "its packed data is damaged");
  return start;
}

bool can_unpack_to(std::uint64_t packed, std::uint64_t unpacked) {
  constexpr std::uint64_t kMostRatio = 1032;
  return unpacked / kMostRatio <= packed;
}

}  // namespace meniscus
