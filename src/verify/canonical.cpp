#include "verify/canonical.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/printed.hpp"
#include "meniscus/error.hpp"

namespace meniscus::verify {
namespace {

constexpr std::string_view kName = "canonical.bin";

class Writer {
 public:
  void number(std::uint64_t value) {
    char bytes[8];
    std::memcpy(bytes, &value, 8);
    bytes_.append(bytes, 8);
  }
  // Most numbers are small.
  void count(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_ += static_cast<char>(value | 0x80);
    bytes_ += static_cast<char>(value);
  }
  void text(std::string_view text) {
    count(text.size());
    bytes_.append(text);
  }
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  std::uint64_t number() {
    std::uint64_t value;
    std::memcpy(&value, take(8).data(), 8);
    return value;
  }
  std::uint64_t count() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<unsigned char>(take(1).front());
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
    throw InputError(std::string(kName) + ": a number has no end");
  }
  std::string_view text() { return take(count()); }
  bool ended() const { return rest_.empty(); }

 private:
  std::string_view take(std::uint64_t size) {
    if (size > rest_.size()) throw InputError(std::string(kName) + ": ends too early");
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }
  std::string_view rest_;
};

// Names recur in every launch: a launch has their numbers.
class Names {
 public:
  std::uint64_t of(const std::string& name) {
    return numbers_.emplace(name, numbers_.size()).first->second;
  }
  void write(Writer& to) const {
    std::vector<std::string_view> ordered(numbers_.size());
    for (const auto& [name, number] : numbers_) ordered[number] = name;
    to.count(ordered.size());
    for (const std::string_view name : ordered) to.text(name);
  }

 private:
  std::map<std::string, std::uint64_t> numbers_;
};

// The first launch of a case in which two devices differ, in words.
std::string first_difference(const Trace& a, const Trace& b) {
  for (std::size_t k = 0; k < std::max(a.size(), b.size()); ++k) {
    const std::string launch = "launch " + std::to_string(k + 1);
    if (k >= a.size() || k >= b.size() || a[k].kernel != b[k].kernel)
      return launch + " is not the same kernel's";
    if (a[k].inputs != b[k].inputs) return launch + ", " + a[k].kernel + ": other inputs";
    if (a[k].written != b[k].written) return launch + ", " + a[k].kernel + ": other results";
  }
  return "";
}

void require_same(const Canonical& a, const Canonical& b) {
  const auto fail = [&](const std::string& name, const std::string& what) {
    throw InvalidArgument("\"" + a.origin.devices.at(0) + "\" and \"" + b.origin.devices.at(0) +
                          "\" differ in " + name + ": " + what +
                          " (nothing is recorded until they agree)");
  };
  for (const auto& [name, trace] : a.traces) {
    const auto other = b.traces.find(name);
    const std::string what =
        first_difference(trace, other == b.traces.end() ? Trace{} : other->second);
    if (!what.empty()) fail(name, what);
  }
  for (const auto& [name, trace] : b.traces)
    if (!a.traces.count(name)) fail(name, "one of them did not run it");
  if (a.frames != b.frames)
    fail("whole frames", "their hashes differ although all launches are the same");
}

}  // namespace

std::string Origin::words() const {
  if (devices.empty()) return "of unknown origin";
  std::string text = "recorded on ";
  for (std::size_t k = 0; k < devices.size(); ++k)
    text += (k == 0 ? "" : k + 1 < devices.size() ? ", " : " and ") + devices[k];
  return text + " at commit " + commit + "; " + counted(references, "output") +
         " within the bounds of double precision, the worst at " + three_digits(share) +
         " of its bound";
}

Canonical agreed(const std::vector<Canonical>& found) {
  Canonical all = found.at(0);
  for (std::size_t k = 1; k < found.size(); ++k) {
    require_same(all, found[k]);
    const Origin& origin = found[k].origin;
    all.origin.devices.insert(all.origin.devices.end(), origin.devices.begin(),
                              origin.devices.end());
    all.origin.references += origin.references;
    all.origin.share = std::max(all.origin.share, origin.share);
  }
  return all;
}

std::string to_bytes(const Canonical& canonical) {
  Names names;
  Writer traces, all;
  traces.count(canonical.traces.size());
  for (const auto& [name, trace] : canonical.traces) {
    traces.text(name);
    traces.count(trace.size());
    for (const TracedLaunch& launch : trace) {
      traces.count(names.of(launch.stage));
      traces.count(names.of(launch.kernel));
      traces.number(launch.inputs);
      traces.count(launch.written.size());
      for (const Written& written : launch.written) {
        traces.count(static_cast<std::uint64_t>(written.argument));
        traces.number(written.hash);
      }
    }
  }
  names.write(all);
  all.bytes_ += traces.bytes_;
  all.count(canonical.values.size());
  for (const auto& [hash, bytes] : canonical.values) {
    all.number(hash);
    all.text({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  all.count(canonical.frames.size());
  for (const auto& [name, hash] : canonical.frames) {
    all.text(name);
    all.number(hash);
  }
  const Origin& origin = canonical.origin;
  all.count(origin.devices.size());
  for (const std::string& device : origin.devices) all.text(device);
  all.text(origin.commit);
  all.count(origin.references);
  all.number(std::bit_cast<std::uint64_t>(origin.share));

  uLongf size = compressBound(all.bytes_.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                reinterpret_cast<const Bytef*>(all.bytes_.data()), all.bytes_.size(), 9) != Z_OK)
    throw Error(std::string(kName) + ": cannot be deflated");
  packed.resize(size);
  Writer file;
  file.number(all.bytes_.size());
  return file.bytes_ + packed;
}

Canonical canonical_from(std::string_view bytes) {
  const std::uint64_t whole = Reader(bytes).number();  // throws when there is not even that
  constexpr std::uint64_t kMost = std::uint64_t{1} << 30;
  if (whole > kMost) throw InputError(std::string(kName) + ": is no such file");
  std::string plain(whole, '\0');
  uLongf size = whole;
  if (uncompress(reinterpret_cast<Bytef*>(plain.data()), &size,
                 reinterpret_cast<const Bytef*>(bytes.data()) + 8, bytes.size() - 8) != Z_OK ||
      size != whole)
    throw InputError(std::string(kName) + ": is damaged");

  Reader from(plain);
  std::vector<std::string> names(from.count());
  for (std::string& name : names) name = from.text();
  Canonical canonical;
  for (std::uint64_t left = from.count(); left > 0; --left) {
    Trace& trace = canonical.traces[std::string(from.text())];
    trace.resize(from.count());
    for (TracedLaunch& launch : trace) {
      launch.stage = names.at(from.count());
      launch.kernel = names.at(from.count());
      launch.inputs = from.number();
      launch.written.resize(from.count());
      for (Written& written : launch.written) {
        written.argument = static_cast<int>(from.count());
        written.hash = from.number();
      }
    }
  }
  for (std::uint64_t left = from.count(); left > 0; --left) {
    const std::uint64_t hash = from.number();
    const std::string_view value = from.text();
    canonical.values.emplace(hash, std::vector<std::uint8_t>(value.begin(), value.end()));
  }
  for (std::uint64_t left = from.count(); left > 0; --left) {
    const std::string name(from.text());
    canonical.frames[name] = from.number();
  }
  if (from.ended()) return canonical;
  Origin& origin = canonical.origin;
  for (std::uint64_t left = from.count(); left > 0; --left)
    origin.devices.emplace_back(from.text());
  origin.commit = from.text();
  origin.references = from.count();
  origin.share = std::bit_cast<double>(from.number());
  return canonical;
}

const Canonical& shipped_canonical() {
  static const Canonical canonical = canonical_from(canonical_file(kName));
  return canonical;
}

}  // namespace meniscus::verify
