#include "fuzz/mutate.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace meniscus::fuzz {
namespace {

using Json = nlohmann::ordered_json;

template <class List>
const auto& one_of(const List& list, Random& random) {
  return list[below(random, std::size(list))];
}

// Numbers at the edges of types and of what readers accept.
const char* const kNumbers[] = {"0",
                                "1",
                                "-1",
                                "3",
                                "7",
                                "127",
                                "128",
                                "255",
                                "256",
                                "65535",
                                "65536",
                                "2147483647",
                                "2147483648",
                                "4294967295",
                                "4294967296",
                                "1e3",
                                "12.0",
                                "9223372036854775807",
                                "-2147483649",
                                "9223372036854775808",
                                "18446744073709551616",
                                "0.5",
                                "1e-320",
                                "1e38",
                                "1e39",
                                "1e308",
                                "1e309",
                                "-1e999",
                                "nan",
                                "inf",
                                "-inf",
                                "-0",
                                "+4",
                                "0x10",
                                ".",
                                "1e",
                                "1.5e-7",
                                "9007199254740993"};

const char* const kTypes[] = {"char",   "int8",   "uchar", "uint8",   "short",  "int16",
                              "ushort", "uint16", "int",   "int32",   "uint",   "uint32",
                              "int64",  "uint64", "float", "float32", "double", "float64"};
const char* const kNames[] = {
    "x",          "y",           "z",     "vx",     "vy",          "vz",    "density",
    "rho",        "id",          "nx",    "radius", "pscale",      "pos.x", "Points:0",
    "velocity_x", "velocity[0]", "X [m]", "v",      "particle_id", "0",     "vertex_indices"};
const char* const kElements[] = {"vertex", "face", "edge", "material", "Vertex", ""};

struct Property {
  std::string name, type, list_count;  // without a list's length: a scalar
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Ply {
  std::string format;
  std::vector<std::string> comments;
  std::vector<Element> elements;
};

std::size_t size_of(const std::string& type) {
  if (type.find("64") != std::string::npos || type == "double") return 8;
  if (type.find("16") != std::string::npos || type.find("short") != std::string::npos) return 2;
  return type.find('8') != std::string::npos || type.find("char") != std::string::npos ? 1 : 4;
}

Property any_property(Random& random) {
  Property property{one_of(kNames, random), one_of(kTypes, random), ""};
  if (below(random, 6) == 0) property.list_count = one_of(kTypes, random);
  return property;
}

Ply any_ply(Random& random) {
  Ply ply;
  const char* const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  ply.format = one_of(formats, random);
  if (below(random, 3) == 0)
    ply.comments.push_back(std::string(below(random, 2) ? "time " : "particle_radius ") +
                           one_of(kNumbers, random));
  const std::size_t counts[] = {0, 1, 2, 3, 5, 40};
  const std::size_t elements = 1 + below(random, 3), vertex = below(random, elements);
  for (std::size_t e = 0; e < elements; ++e) {
    Element element{one_of(kElements, random), one_of(counts, random), {}};
    if (e == vertex && below(random, 16) != 0) {
      element.name = "vertex";
      for (const char* axis : {"x", "y", "z"})
        element.properties.push_back(
            {axis, below(random, 2) ? "float" : one_of(kTypes, random), ""});
      if (below(random, 3) == 0)
        for (const char* axis : {"vx", "vy", "vz"})
          element.properties.push_back({axis, "float", ""});
    }
    for (std::size_t k = below(random, 4); k > 0; --k) {
      const std::size_t at = below(random, element.properties.size() + 1);
      element.properties.insert(element.properties.begin() + static_cast<long>(at),
                                any_property(random));
    }
    ply.elements.push_back(element);
  }
  return ply;
}

std::string header_of(const Ply& ply, const char* end) {
  std::string text = std::string("ply") + end + "format " + ply.format + " 1.0" + end;
  for (const std::string& comment : ply.comments) text += "comment " + comment + end;
  for (const Element& element : ply.elements) {
    text += "element " + element.name + " " + std::to_string(element.count) + end;
    for (const Property& p : element.properties)
      text += "property " + (p.list_count.empty() ? "" : "list " + p.list_count + " ") + p.type +
              " " + p.name + end;
  }
  return text + "end_header" + end;
}

// A value of `type`; `wanted`: that one, else any.
std::string stored(const std::string& type, bool big, const std::uint64_t* wanted, Random& random) {
  const std::size_t size = size_of(type);
  std::uint64_t bits = wanted ? *wanted : 0;
  if (!wanted) {
    const float floats[] = {0, 1, -2.5f, 1e-40f, 3e38f, INFINITY, NAN, 16777217.0f};
    const std::uint64_t whole[] = {0, 1, 0x7f, 0x80, 0xff, 0x8000, 0x7fffffff, ~std::uint64_t{0}};
    const bool real = type.starts_with("float") || type == "double";
    if (below(random, 4) == 0) {
      bits = (std::uint64_t{random()} << 32) ^ random();
    } else if (real && size == 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, &one_of(floats, random), 4);
      bits = word;
    } else if (real) {
      const double value = one_of(floats, random) * (below(random, 4) ? 1 : 1e300);
      std::memcpy(&bits, &value, 8);
    } else {
      bits = one_of(whole, random);
    }
  }
  std::string bytes(reinterpret_cast<const char*>(&bits), size);
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string data_of(const Ply& ply, std::size_t most, Random& random) {
  std::string data;
  const bool ascii = ply.format == "ascii", big = ply.format == "binary_big_endian";
  const auto value = [&](const std::string& type, const std::uint64_t* wanted) {
    if (!ascii) {
      data += stored(type, big, wanted, random);
      return;
    }
    if (wanted)
      data += std::to_string(*wanted);
    else if (below(random, 4) == 0)
      data += one_of(kNumbers, random);
    else
      data += std::to_string(below(random, 100));
    data += below(random, 8) ? ' ' : '\n';
  };
  for (const Element& element : ply.elements)
    for (std::size_t row = 0;
         !element.properties.empty() && row < element.count && data.size() < most; ++row)
      for (const Property& p : element.properties) {
        std::uint64_t length = below(random, 4);
        if (p.list_count.empty())
          length = 1;
        else
          value(p.list_count, below(random, 32) ? &length : nullptr);
        for (; length > 0; --length) value(p.type, nullptr);
      }
  return data;
}

// What a header says, as far as it can be made out.
Ply parse(const std::string& header) {
  Ply ply;
  std::istringstream lines(header);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    if (words.size() > 1 && words[0] == "format") ply.format = words[1];
    if (words.size() > 1 && words[0] == "comment") ply.comments.push_back(line.substr(8));
    if (words.size() == 3 && words[0] == "element")
      ply.elements.push_back({words[1], std::strtoul(words[2].c_str(), nullptr, 10), {}});
    if (ply.elements.empty()) continue;
    std::vector<Property>& properties = ply.elements.back().properties;
    if (words.size() == 3 && words[0] == "property") properties.push_back({words[2], words[1], ""});
    if (words.size() == 5 && words[0] == "property")
      properties.push_back({words[4], words[3], words[2]});
  }
  return ply;
}

// Another property, element, type, count or format.
void mutate(Ply& ply, Random& random) {
  if (ply.elements.empty()) ply = any_ply(random);
  Element& element = ply.elements[below(random, ply.elements.size())];
  std::vector<Property>& properties = element.properties;
  switch (below(random, 7)) {
    case 0:
      properties.push_back(any_property(random));
      break;
    case 1:
      if (!properties.empty())
        properties.erase(properties.begin() + static_cast<long>(below(random, properties.size())));
      break;
    case 2:
      if (!properties.empty()) properties[below(random, properties.size())] = any_property(random);
      break;
    case 3:
      element.count = below(random, 4) ? element.count + below(random, 5) : 3 * element.count;
      break;
    case 4:
      std::shuffle(properties.begin(), properties.end(), random);
      break;
    case 5:
      ply.comments.push_back(std::string(below(random, 2) ? "time " : "particle_radius ") +
                             one_of(kNumbers, random));
      break;
    default:
      ply.elements.push_back(any_ply(random).elements.front());
  }
}

// A node somewhere below `node`, itself included.
Json& some_node(Json& node, Random& random) {
  if (node.is_structured() && !node.empty() && below(random, 5) != 0) {
    auto child = node.begin();
    std::advance(child, static_cast<long>(below(random, node.size())));
    return some_node(*child, random);
  }
  return node;
}

Json any_value(Random& random) {
  const Json values[] = {nullptr,
                         true,
                         "",
                         "done",
                         "\xc3\xa9\x1b[31m<b>&\"",
                         Json::array(),
                         Json::object(),
                         Json::array({1, 2, 3, 4}),
                         {{"frame", 0}}};
  if (below(random, 2)) return one_of(values, random);
  const Json number = Json::parse(one_of(kNumbers, random), nullptr, false);
  return number.is_discarded() ? Json(one_of(kNumbers, random)) : number;
}

void mutate(Json& root, Random& random) {
  Json& node = some_node(root, random);
  switch (below(random, 6)) {
    case 0:
      node = any_value(random);
      break;
    case 1:
      if (node.is_array()) node.push_back(node.empty() ? any_value(random) : Json(node.back()));
      break;
    case 2:
      if (node.is_structured() && !node.empty())
        node.erase(std::next(node.begin(), static_cast<long>(below(random, node.size()))));
      break;
    case 3:
      node = Json(some_node(root, random));
      break;
    case 4:
      node = below(random, 2) ? Json::array({node}) : Json{{"x", node}};
      break;
    default:
      if (node.is_number_integer())
        node = node.get<std::int64_t>() ^ (std::int64_t{1} << below(random, 63));
      else if (node.is_string())
        node = any_mutation(node.get<std::string>(), 200);
      else
        node = any_value(random);
  }
}

std::string mutate_line(const std::string& line, Random& random) {
  Json root = Json::parse(line, nullptr, false);
  if (root.is_discarded()) return line;
  for (std::size_t k = 1 + below(random, 3); k > 0; --k) mutate(root, random);
  return root.dump(-1, ' ', false, Json::error_handler_t::ignore);
}

}  // namespace

std::string any_mutation(std::string bytes, std::size_t most) {
  const std::size_t size = std::min(bytes.size(), most);
  bytes.resize(std::max<std::size_t>(most, 1));
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

std::string mutate_ply(std::string bytes, std::size_t most, Random& random) {
  const std::string last = "end_header\n";
  const std::size_t found = bytes.find(last), end = found + last.size();
  const std::size_t way = found == std::string::npos ? below(random, 3) : below(random, 8);
  const char* const ends[] = {"\n", "\n", "\n", "\r\n", "\r"};
  switch (way) {
    case 0:
      bytes = any_mutation(bytes, most);
      break;
    case 1:
    case 2: {
      const Ply ply = any_ply(random);
      bytes = header_of(ply, one_of(ends, random)) + data_of(ply, most, random);
      break;
    }
    case 3:  // other data below the same header
      if (end < most) bytes = bytes.substr(0, end) + any_mutation(bytes.substr(end), most - end);
      break;
    case 4: {  // a number of the header, whether or not the data fit
      const std::size_t digit = bytes.find_first_of("0123456789", below(random, end));
      if (digit < end)
        bytes.replace(digit, bytes.find_first_not_of("0123456789.e", digit) - digit,
                      one_of(kNumbers, random));
      break;
    }
    default: {  // another header, and the data that it wants
      Ply ply = parse(bytes.substr(0, end));
      mutate(ply, random);
      const std::string data = data_of(ply, most, random);
      std::string kept = bytes.substr(end);
      if (way == 5) kept += data.substr(std::min(kept.size(), data.size()));
      if (way == 5) kept.resize(std::min(kept.size(), data.size()));
      bytes = header_of(ply, one_of(ends, random)) + (way == 5 ? kept : data);
    }
  }
  if (below(random, 16) == 0 && !bytes.empty()) bytes.resize(below(random, bytes.size()) + 1);
  bytes.resize(std::min(bytes.size(), most));
  return bytes;
}

std::string mutate_json(const std::string& bytes, std::size_t most, bool lines, Random& random) {
  if (below(random, 3) == 0) return any_mutation(bytes, most);
  std::string mutated;
  if (lines) {
    std::istringstream stream(bytes);
    for (std::string line; std::getline(stream, line);) {
      for (std::size_t times = below(random, 12) ? 1 : below(random, 3); times > 0; --times)
        mutated += (below(random, 2) ? mutate_line(line, random) : line) + "\n";
    }
  } else {
    mutated = mutate_line(bytes, random);
  }
  if (mutated.empty() || mutated.size() > most) return any_mutation(bytes, most);
  return mutated;
}

std::string mutate_png(const std::string& bytes, std::size_t most) {
  std::string mutated = any_mutation(bytes, most);
  const auto word = [&](std::size_t at) {
    const auto byte = [&](std::size_t k) { return static_cast<std::uint8_t>(mutated[at + k]); };
    return byte(0) << 24u | byte(1) << 16u | byte(2) << 8u | byte(3);
  };
  // Length, name, data, checksum of name and data.
  for (std::size_t at = 8; at + 12 <= mutated.size();) {
    const std::size_t length = static_cast<std::uint32_t>(word(at));
    if (length > mutated.size() - at - 12) break;
    const uLong sum =
        crc32(0, reinterpret_cast<const Bytef*>(&mutated[at + 4]), static_cast<uInt>(length + 4));
    for (std::size_t k = 0; k < 4; ++k)
      mutated[at + 8 + length + k] = static_cast<char>(sum >> (24 - 8 * k));
    at += 12 + length;
  }
  return mutated;
}

}  // namespace meniscus::fuzz
