// Reading what a manifest says of a kernel.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "base/comma_separated.hpp"
#include "base/grouped.hpp"
#include "base/printed.hpp"
#include "io/json_number.hpp"
#include "io/json_text.hpp"
#include "verify/program.hpp"

namespace meniscus::verify {
namespace {

using Json = nlohmann::ordered_json;
using Kind = ValueType::Kind;

constexpr std::size_t kMostText = std::size_t{16} << 20;  // bytes of a manifest or a source
constexpr std::size_t kMostBytes = std::size_t{1} << 30;  // of all arguments
constexpr std::size_t kMostItems = std::size_t{1} << 31;  // work-items along one axis
constexpr int kMostRuns = 10'000;

struct BaseType {
  const char* name;
  Kind kind;
  std::size_t bytes;
};
constexpr std::array kTypes{
    BaseType{"char", Kind::integer, 1},   BaseType{"uchar", Kind::unsigned_integer, 1},
    BaseType{"short", Kind::integer, 2},  BaseType{"ushort", Kind::unsigned_integer, 2},
    BaseType{"int", Kind::integer, 4},    BaseType{"uint", Kind::unsigned_integer, 4},
    BaseType{"long", Kind::integer, 8},   BaseType{"ulong", Kind::unsigned_integer, 8},
    BaseType{"float", Kind::floating, 4}, BaseType{"double", Kind::floating, 8}};

// Reads one manifest. `place_` in messages: "argument 2 (sum)".
class Reader {
 public:
  Reader(const InputFile& file, std::optional<std::filesystem::path> folder)
      : file_(file), folder_(std::move(folder)) {}

  Program program() {
    const Json root = parsed();
    if (!root.is_object())
      fail(file_, "",
           "found " + in_quotes_of(root) +
               ", wanted {\"kernel\": ..., \"range\": [...], \"arguments\": [...]}");
    check_keys(root, {"kernel", "options", "range", "group", "repeat", "arguments"});
    Program program;
    program.name = file_.name;
    program.kernel = text(root, "kernel", true);
    program.options = text(root, "options", false);
    program.range = sizes(root, "range");
    if (program.range.empty())
      fail(file_, "", "has no key \"range\", wanted [items], or one for each axis");
    program.group = sizes(root, "group");
    if (!program.group.empty() && program.group.size() != program.range.size())
      fail(file_, "group",
           "has " + counted(program.group.size(), "number") +
               ", wanted as many as \"range\": " + std::to_string(program.range.size()));
    for (std::size_t k = 0; k < program.group.size(); ++k)
      if (program.range[k] % program.group[k] != 0)
        fail(file_, "group",
             std::to_string(program.group[k]) + " does not divide the range " +
                 std::to_string(program.range[k]) +
                 ", as OpenCL 1.2 wants (round the range up, and return from the kernel beyond the "
                 "end)");
    if (const auto repeat = root.find("repeat"); repeat != root.end()) {
      const auto runs = whole_number<int>(*repeat);
      if (!runs || *runs < 1 || *runs > kMostRuns)
        wrong("repeat", repeat->dump(), "a whole number from 1 to " + std::to_string(kMostRuns));
      program.repeat = *runs;
    }
    const auto arguments = root.find("arguments");
    if (arguments == root.end() || !arguments->is_array() || arguments->empty())
      fail(file_, "arguments",
           "wanted a list of the kernel's arguments: [{\"type\": \"float\", ...}, ...]");
    for (const Json& argument : *arguments) {
      place_ = "argument " + std::to_string(program.arguments.size());
      program.arguments.push_back(read_argument(argument));
    }
    return program;
  }

 private:
  Json parsed() const {
    try {
      return parse_json<Json>(file_.bytes);
    } catch (const InputError& error) {
      fail(file_, "", std::string("is not JSON: ") + error.what());
    }
  }

  [[noreturn]] void wrong(const std::string& key, const std::string& found,
                          const std::string& wanted) const {
    fail(file_, place_, key + ": found " + in_quotes(found) + ", wanted " + wanted);
  }

  void check_keys(const Json& object, const std::vector<std::string>& known) const {
    for (const auto& [key, value] : object.items())
      if (std::find(known.begin(), known.end(), key) == known.end())
        fail(file_, place_,
             "unknown key " + in_quotes(key) + ", wanted one of " + comma_separated(known));
  }

  std::string text(const Json& object, const char* key, bool required) const {
    const auto found = object.find(key);
    if (found == object.end() && !required) return "";
    if (found == object.end()) fail(file_, place_, std::string("has no key \"") + key + "\"");
    if (!found->is_string() || (required && found->get<std::string>().empty()))
      wrong(key, found->dump(), "a text");
    return *found;
  }

  // None where there is no such key.
  std::optional<std::uint64_t> whole(const Json& object, const char* key,
                                     std::uint64_t least) const {
    const auto found = object.find(key);
    if (found == object.end()) return std::nullopt;
    const auto number = whole_number<std::uint64_t>(*found);
    if (!number || *number < least)
      wrong(key, found->dump(), "a whole number from " + std::to_string(least) + " on");
    return number;
  }

  // Work-items along up to three axes.
  std::vector<std::size_t> sizes(const Json& root, const char* key) const {
    const auto found = root.find(key);
    if (found == root.end()) return {};
    std::vector<std::size_t> all;
    if (found->is_array())
      for (const Json& size : *found) {
        const auto number = whole_number<std::size_t>(size);
        if (number && *number > 0 && *number <= kMostItems) all.push_back(*number);
      }
    if (all.empty() || all.size() > 3 || all.size() != found->size())
      wrong(key, found->dump(),
            "1 to 3 whole numbers from 1 to " + std::to_string(kMostItems) +
                ", as [1024] or [64, 64]");
    return all;
  }

  ValueType type_of(const Json& object) const {
    const std::string name = text(object, "type", true);
    const std::size_t digits = std::min(name.find_first_of("0123456789"), name.size());
    const auto base = std::find_if(kTypes.begin(), kTypes.end(), [&](const BaseType& type) {
      return name.substr(0, digits) == type.name;
    });
    const std::string rest = name.substr(digits);
    constexpr std::array kWidths{"2", "3", "4", "8", "16"};
    if (base == kTypes.end() ||
        !(rest.empty() || std::find(kWidths.begin(), kWidths.end(), rest) != kWidths.end())) {
      wrong("type", name,
            "one of " + comma_separated(kTypes, &BaseType::name) +
                ", or a vector of them such as float4");
    }
    return {name, base->kind, base->bytes,
            rest.empty() ? 1 : static_cast<std::size_t>(std::stoi(rest))};
  }

  void take(std::size_t count, std::size_t size) {
    if (size > 0 && count > (kMostBytes - taken_) / size)
      fail(file_, place_,
           "would take " + grouped(count) + " times " + counted(size, "byte") +
               ", and all arguments together may take " + size_of(kMostBytes) +
               " (give a smaller count)");
    taken_ += count * size;
  }

  template <class T>
  static void append(Bytes& bytes, T value) {
    const auto raw = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);
    bytes.insert(bytes.end(), raw.begin(), raw.end());
  }

  static void append_bits(Bytes& bytes, std::uint64_t bits, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k)
      bytes.push_back(static_cast<std::uint8_t>(bits >> 8 * k));
  }

  [[noreturn]] void no_number(const char* key, const Json& value, const ValueType& type) const {
    wrong(key, value.dump(),
          "a number that a " + type.name + " holds" +
              (type.kind == Kind::floating ? ", \"nan\", \"inf\", \"-inf\"" : "") +
              " or its bits, as \"0x80000000\"");
  }

  // One component.
  void append_number(Bytes& bytes, const char* key, const Json& value,
                     const ValueType& type) const {
    if (value.is_string()) {
      const std::string words = value;
      if (type.kind == Kind::floating && (words == "nan" || words == "inf" || words == "-inf"))
        return append_real(bytes,
                           words == "nan"   ? NAN
                           : words == "inf" ? INFINITY
                                            : -INFINITY,
                           type);
      const bool hex = words.starts_with("0x") && words.size() > 2 &&
                       words.size() <= 2 + 2 * type.bytes &&
                       words.find_first_not_of("0123456789abcdefABCDEF", 2) == std::string::npos;
      if (!hex) no_number(key, value, type);
      return append_bits(bytes, std::stoull(words, nullptr, 16), type.bytes);
    }
    if (type.kind == Kind::floating) {
      if (!value.is_number()) no_number(key, value, type);
      const double number = value;
      if (type.bytes == 4 && !std::isfinite(static_cast<float>(number)))
        no_number(key, value, type);
      return append_real(bytes, number, type);
    }
    const auto bits = 8 * type.bytes;
    if (type.kind == Kind::unsigned_integer) {
      const auto number = whole_number<std::uint64_t>(value);
      if (!number || (bits < 64 && *number >> bits != 0)) no_number(key, value, type);
      return append_bits(bytes, *number, type.bytes);
    }
    const auto number = whole_number<std::int64_t>(value);
    const std::int64_t most = static_cast<std::int64_t>(~std::uint64_t{0} >> (65 - bits));
    if (!number || *number > most || *number < -most - 1) no_number(key, value, type);
    append_bits(bytes, static_cast<std::uint64_t>(*number), type.bytes);
  }

  static void append_real(Bytes& bytes, double value, const ValueType& type) {
    if (type.bytes == 4)
      append(bytes, static_cast<float>(value));
    else
      append(bytes, value);
  }

  // Numbers of a list, which `key` names; `count`: of components that are wanted, 0: any.
  Bytes list(const char* key, const Json& values, const ValueType& type, std::size_t count) const {
    if (!values.is_array() || values.empty()) wrong(key, values.dump(), "a list of numbers");
    if (count > 0 && values.size() != count)
      fail(file_, place_,
           std::string(key) + ": has " + counted(values.size(), "number") + ", wanted " +
               grouped(count));
    if (values.size() % type.components != 0)
      fail(file_, place_,
           std::string(key) + ": has " + counted(values.size(), "number") +
               ", wanted a multiple of the " + std::to_string(type.components) + " of a " +
               type.name);
    Bytes bytes;
    for (const Json& value : values) append_number(bytes, key, value, type);
    return bytes;
  }

  // Two numbers: [low, high] or [first, step].
  std::array<double, 2> pair(const char* key, const Json& values, const char* wanted) const {
    if (!values.is_array() || values.size() != 2 || !values[0].is_number() ||
        !values[1].is_number())
      wrong(key, values.dump(), wanted);
    return {values[0], values[1]};
  }

  Bytes raw_file(const char* key, const Json& value, const ValueType& type, std::size_t wanted) {
    if (!folder_)
      fail(file_, place_, std::string(key) + ": files are not read here, wanted numbers");
    if (!value.is_string() || value.get<std::string>().empty())
      wrong(key, value.dump(), "the name of a file of raw values");
    const std::string path = (*folder_ / value.get<std::string>()).string();
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(path, error);
    const auto check = [&](std::uint64_t bytes) {
      if (bytes == 0 || bytes % type.size() != 0 || (wanted > 0 && bytes != wanted))
        fail(file_, place_,
             path + ": has " + counted(bytes, "byte") + ", wanted " +
                 (wanted > 0
                      ? grouped(wanted)
                      : "a multiple of the " + std::to_string(type.size()) + " of a " + type.name));
    };
    if (!error) {
      check(size);
      take(size, 1);
    }
    const InputFile content = read_file(path);
    check(content.size());
    return Bytes(content.bytes.begin(), content.bytes.end());
  }

  // The values of a buffer of so many components, each made by `make`.
  template <class Make>
  static Bytes made(std::size_t components, const ValueType& type, const Make& make) {
    Bytes bytes;
    bytes.reserve(components * type.bytes);
    for (std::size_t k = 0; k < components; ++k) make(bytes, k);
    return bytes;
  }

  Bytes random(const Json& object, const ValueType& type, std::size_t components) const {
    const std::array<double, 2> both = pair("random", object.at("random"), "[low, high]");
    const double low = both[0], high = both[1];  // by name: clang 14 captures no bindings
    const std::uint64_t seed = whole(object, "seed", 0).value_or(1);
    Bytes ends;  // both fit the type
    for (const Json& end : object.at("random")) append_number(ends, "random", end, type);
    if (!(low <= high)) fail(file_, place_, "random: low is above high, wanted [low, high]");
    std::mt19937_64 next(seed);
    if (type.kind == Kind::floating)
      return made(components, type, [&](Bytes& bytes, std::size_t) {
        append_real(bytes, low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53, type);
      });
    const auto least = static_cast<std::uint64_t>(object.at("random")[0].get<std::int64_t>());
    const std::uint64_t span =
        static_cast<std::uint64_t>(object.at("random")[1].get<std::int64_t>()) - least + 1;
    return made(components, type, [&](Bytes& bytes, std::size_t) {
      append_bits(bytes, least + (span == 0 ? next() : next() % span), type.bytes);
    });
  }

  Bytes sequence(const Json& object, const ValueType& type, std::size_t components) const {
    const std::array<double, 2> both = pair("sequence", object.at("sequence"), "[first, step]");
    const double first = both[0], step = both[1];  // by name: clang 14 captures no bindings
    if (type.kind == Kind::floating)
      return made(components, type, [&](Bytes& bytes, std::size_t k) {
        append_real(bytes, first + step * static_cast<double>(k), type);
      });
    for (const Json& number : object.at("sequence"))
      if (!whole_number<std::int64_t>(number))
        wrong("sequence", number.dump(), "whole numbers for " + type.name);
    const auto begin = static_cast<std::uint64_t>(object.at("sequence")[0].get<std::int64_t>());
    const auto each = static_cast<std::uint64_t>(object.at("sequence")[1].get<std::int64_t>());
    return made(components, type, [&](Bytes& bytes, std::size_t k) {
      append_bits(bytes, begin + each * k, type.bytes);
    });
  }

  // What a buffer holds before the launch.
  Bytes contents(const Json& object, const ValueType& type) {
    const std::size_t count = whole(object, "count", 1).value_or(0);
    constexpr std::array kWays{"values", "fill", "random", "sequence", "file"};
    std::vector<std::string> ways;
    for (const char* way : kWays)
      if (object.contains(way)) ways.push_back(way);
    if (ways.size() > 1)
      fail(file_, place_, "has " + comma_separated(ways) + ", wanted one of them");
    const std::string way = ways.empty() ? "fill" : ways.front();
    if (object.contains("seed") && way != "random")
      fail(file_, place_, "seed: goes with \"random\" alone");
    if (count > kMostBytes / type.size()) take(count, type.size());  // throws
    if (way == "file") return raw_file("file", object.at("file"), type, count * type.size());
    if (way == "values") {
      take(object.at("values").size(), type.bytes);
      return list("values", object.at("values"), type, count * type.components);
    }
    if (count == 0)
      fail(file_, place_,
           "has no key \"count\", wanted one, or \"values\" or \"file\", or, for what is no "
           "buffer, \"value\" or \"local\"");
    take(count, type.size());
    const std::size_t components = count * type.components;
    if (way == "random") return random(object, type, components);
    if (way == "sequence") return sequence(object, type, components);
    Bytes one;
    append_number(one, "fill", object.contains("fill") ? object.at("fill") : Json(0), type);
    return made(components, type, [&](Bytes& bytes, std::size_t) {
      bytes.insert(bytes.end(), one.begin(), one.end());
    });
  }

  ProgramArgument read_argument(const Json& object) {
    if (!object.is_object())
      fail(file_, place_, "found " + in_quotes_of(object) + ", wanted {\"type\": ..., ...}");
    check_keys(object, {"name", "type", "count", "values", "fill", "random", "seed", "sequence",
                        "file", "value", "local", "expected", "ulp", "compare"});
    ProgramArgument argument;
    if (const std::string name = text(object, "name", false); name.empty()) {
      argument.name = place_.substr(place_.rfind(' ') + 1);
    } else {
      argument.name = shown(name);
      place_ += " (" + argument.name + ")";
    }
    const bool is_value = object.contains("value"), is_local = object.contains("local");
    if (is_value || is_local)
      for (const auto& [key, value] : object.items())
        if (key != "name" && key != "type" && key != "value" && key != "local")
          fail(file_, place_,
               "has both \"" + std::string(is_local ? "local" : "value") + "\" and \"" + key +
                   "\", which is for buffers");
    if (is_local)
      read_local(object, argument);
    else if (is_value)
      read_value(object, argument);
    else
      read_buffer(object, argument);
    return argument;
  }

  void read_local(const Json& object, ProgramArgument& argument) const {
    const Json& local = object.at("local");
    const auto bytes = whole_number<std::size_t>(local);
    if (object.contains("value") || object.contains("type") || !bytes || *bytes == 0 ||
        *bytes > kMostBytes)
      wrong("local", local.dump(), "bytes of local memory, and no \"type\" or \"value\"");
    argument.kind = ProgramArgument::Kind::local;
    argument.local_bytes = *bytes;
  }

  void read_value(const Json& object, ProgramArgument& argument) const {
    argument.kind = ProgramArgument::Kind::value;
    const ValueType& type = argument.type = type_of(object);
    const Json& value = object.at("value");
    if (type.components == 1)
      append_number(argument.bytes, "value", value, type);
    else
      argument.bytes = list("value", value, type, type.components);
    argument.bytes.resize(type.size());
  }

  void read_buffer(const Json& object, ProgramArgument& argument) {
    const ValueType& type = argument.type = type_of(object);
    if (type.components == 3)
      wrong("type", type.name,
            "a vector of 2, 4, 8 or 16 for a buffer (one of three takes the room of four)");
    argument.bytes = contents(object, type);
    if (const auto ulp = object.find("ulp"); ulp != object.end()) {
      if (type.kind != Kind::floating || !ulp->is_number() || !(ulp->get<double>() >= 0))
        wrong("ulp", ulp->dump(), "a number from 0 on, for float or double");
      argument.ulp = *ulp;
    }
    if (const auto compare = object.find("compare"); compare != object.end()) {
      if (!compare->is_boolean()) wrong("compare", compare->dump(), "true or false");
      argument.compared = *compare;
    }
    if (const auto expected = object.find("expected"); expected != object.end()) {
      if (expected->is_string()) {
        argument.expected = raw_file("expected", *expected, type, argument.bytes.size());
      } else {
        take(argument.bytes.size(), 1);
        argument.expected = list("expected", *expected, type, argument.bytes.size() / type.bytes);
      }
    }
  }

  const InputFile& file_;
  std::optional<std::filesystem::path> folder_;
  std::string place_;      // empty: no argument
  std::size_t taken_ = 0;  // bytes of all arguments so far
};

InputFile read_text(const std::string& path) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (!error && size > kMostText)
    fail({path, {}}, "", "has " + size_of(size) + ", wanted at most " + size_of(kMostText));
  return read_file(path);
}

// What names a file in the compiler's messages, where it would name one of its own.
std::string line_directive(const std::filesystem::path& path) {
  std::string name;
  for (const char c : path.filename().string()) {
    if (c == '"' || c == '\\') name += '\\';
    name += c;
  }
  return "#line 1 \"" + name + "\"\n";
}

}  // namespace

Program program_of(const std::string& source, const InputFile& manifest) {
  Program program = Reader(manifest, std::nullopt).program();
  program.source = source;
  return program;
}

Program read_program(const std::string& source, const std::string& manifest) {
  const InputFile file = read_text(manifest);
  Program program = Reader(file, std::filesystem::path(manifest).parent_path()).program();
  program.source = line_directive(source) + read_text(source).bytes;
  return program;
}

}  // namespace meniscus::verify
