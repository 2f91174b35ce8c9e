#include "io/hdf5_objects.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "base/rounded_up.hpp"
#include "io/readers.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kMostObjects = 10000, kMostMessages = 4096, kDeepest = 32;

struct Link {
  std::string name;
  std::uint64_t address = 0;  // of its object
};

// What an object's header says: a group has links, a data set a layout.
struct Object {
  Hdf5DataSet data;
  std::vector<Link> links;
  std::string unknown;  // why its links cannot be read
};

class Reader {
 public:
  explicit Reader(const std::shared_ptr<const Bytes>& file) : file_(file) {
    std::uint64_t at = 0;
    while (text_or_nothing(at, 8) != std::string("\x89HDF\r\n\x1a\n", 8)) {
      at = at == 0 ? 512 : 2 * at;
      if (at >= file_->size()) fail(*file_, "", "has no signature of HDF5");
    }
    const auto version = number(at + 8, 1);
    std::uint64_t root = 0;
    if (version <= 1) {
      offsets_ = number(at + 13, 1);
      lengths_ = number(at + 14, 1);
      check_sizes();
      const std::uint64_t fields = at + (version == 0 ? 24 : 28);
      base_ = number(fields, offsets_);
      root = number(fields + 4 * offsets_ + offsets_, offsets_);
    } else if (version <= 3) {
      offsets_ = number(at + 9, 1);
      lengths_ = number(at + 10, 1);
      check_sizes();
      base_ = number(at + 12, offsets_);
      root = number(at + 12 + 3 * offsets_, offsets_);
    } else {
      fail(*file_, byte_place(static_cast<std::size_t>(at) + 8),
           "found superblock " + std::to_string(version) + ", wanted 0 to 3");
    }
    walk("", root, 0);
  }

  Hdf5Objects objects() && {
    objects_.base = base_;
    objects_.offsets = offsets_;
    return std::move(objects_);
  }

 private:
  std::string text_or_nothing(std::uint64_t at, std::size_t size) const {
    return at <= file_->size() && size <= file_->size() - at ? text_at(*file_, at, size) : "";
  }
  std::string text(std::uint64_t at, std::uint64_t size) const {
    return text_at(*file_, at, static_cast<std::size_t>(std::min(size, file_->size() + 1)));
  }
  std::uint64_t number(std::uint64_t at, std::size_t size) const {
    return number_in(text_at(*file_, at, size), 0, size);
  }
  // Little-endian; where all bits are set it is undefined. 0 beyond the end, which is no address.
  static std::uint64_t number_in(const std::string& bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    if (at > bytes.size() || size > bytes.size() - at) return 0;
    for (std::size_t k = 0; k < size; ++k)
      value |= std::uint64_t{static_cast<unsigned char>(bytes[at + k])} << (8 * k);
    if (size < 8 && size >= 4 && value == (std::uint64_t{1} << (8 * size)) - 1)
      return kHdf5Undefined;
    return value;
  }
  void check_sizes() const {
    for (const std::uint64_t size : {offsets_, lengths_})
      if (size != 4 && size != 8)
        fail(*file_, "superblock",
             "states numbers of " + std::to_string(size) + " bytes, wanted 4 or 8");
  }
  std::uint64_t place(std::uint64_t address) const {
    std::uint64_t at = 0;
    if (address == kHdf5Undefined || __builtin_add_overflow(address, base_, &at) ||
        at >= file_->size())
      fail(*file_, "",
           "an address leads to byte " + std::to_string(address) +
               ", beyond the file's end (truncated?)");
    return at;
  }

  void walk(const std::string& path, std::uint64_t address, std::size_t depth) {
    if (depth > kDeepest || !seen_.insert(address).second) return;  // a link back
    if (seen_.size() > kMostObjects) fail(*file_, "", "has too many groups and data sets");
    Object object = read_object(address);
    if (object.data.has_layout) {
      if (path.empty()) fail(*file_, "", "its root is no group (damaged?)");
      object.data.path = path.substr(1);
      objects_.sets.push_back(std::move(object.data));
      return;
    }
    if (!object.unknown.empty())
      objects_.unknown = (path.empty() ? "/" : shown(path)) + " " + object.unknown;
    for (const Link& link : object.links) walk(path + "/" + link.name, link.address, depth + 1);
  }

  struct Message {
    unsigned type = 0;
    std::string data;
  };

  std::vector<Message> messages_of(std::uint64_t address) {
    std::vector<Message> messages;
    struct Block {
      std::uint64_t at, size;
    };
    std::vector<Block> blocks;
    const std::uint64_t at = place(address);
    const bool second = text_or_nothing(at, 4) == "OHDR";
    std::size_t head = 8;
    if (second) {
      const auto flags = number(at + 5, 1);
      std::uint64_t from = at + 6 + (flags & 0x20 ? 16 : 0) + (flags & 0x10 ? 4 : 0);
      const std::size_t width = std::size_t{1} << (flags & 3);
      blocks.push_back({from + width, number(from, width)});
      head = 4 + (flags & 4 ? 2 : 0);
    } else {
      if (number(at, 1) != 1)
        fail(*file_, byte_place(static_cast<std::size_t>(at)), "wanted the header of an object");
      blocks.push_back({at + 16, number(at + 8, 4)});
    }
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      constexpr std::size_t kMostBlocks = 1024;
      if (b == kMostBlocks) fail(*file_, "", "an object's header never ends");
      const std::string block = text(blocks[b].at, blocks[b].size);
      for (std::size_t p = 0; p + head <= block.size();) {
        Message message;
        message.type = static_cast<unsigned>(number_in(block, p, second ? 1 : 2));
        const auto size = static_cast<std::size_t>(number_in(block, p + (second ? 1 : 2), 2));
        const auto flags = number_in(block, p + (second ? 3 : 4), 1);
        if (size > block.size() - p - head) break;  // a gap
        message.data = block.substr(p + head, size);
        p += head + size;
        if (message.type == 0x10) {
          std::uint64_t from = place(number_in(message.data, 0, offsets_));
          std::uint64_t length = number_in(message.data, offsets_, lengths_);
          if (second && length >= 8) {  // between "OCHK" and a checksum
            from += 4;
            length -= 8;
          }
          blocks.push_back({from, length});
        } else if (flags & 2) {
          message.data.clear();  // shared: kept elsewhere
          message.type |= 0x100;
          messages.push_back(std::move(message));
        } else {
          messages.push_back(std::move(message));
        }
        if (messages.size() > kMostMessages) fail(*file_, "", "an object has too many messages");
      }
    }
    return messages;
  }

  Object read_object(std::uint64_t address) {
    Object object;
    for (const Message& message : messages_of(address)) {
      const std::string& d = message.data;
      Hdf5DataSet& data = object.data;
      switch (message.type) {
        case 0x01:
          data.has_space = true;
          read_space(d, data);
          break;
        case 0x03:
          read_type(d, data);
          break;
        case 0x103:
          data.unknown = "has a type that is kept elsewhere";
          break;
        case 0x08:
          data.has_layout = true;
          read_layout(d, data);
          break;
        case 0x0b:
          read_filters(d, data);
          break;
        case 0x11:
          read_symbols(place(number_in(d, 0, offsets_)), number_in(d, offsets_, offsets_),
                       object.links);
          break;
        case 0x06:
          read_link(d, object.links);
          break;
        case 0x02: {
          const bool tracked = number_in(d, 1, 1) & 1;
          if (number_in(d, tracked ? 10 : 2, offsets_) != kHdf5Undefined)
            object.unknown =
                "keeps its links in a heap, which is not read (save it with "
                "h5py's default libver)";
          break;
        }
        default:
          break;
      }
    }
    return object;
  }

  void read_space(const std::string& d, Hdf5DataSet& data) const {
    const auto version = number_in(d, 0, 1), rank = number_in(d, 1, 1);
    const std::size_t first = version == 1 ? 8 : 4;
    constexpr std::uint64_t kMostRank = 32;
    if (rank > kMostRank || d.size() < first + rank * lengths_) {
      data.unknown = "has dimensions that are not known";
      return;
    }
    for (std::size_t k = 0; k < rank; ++k)
      data.shape.push_back(number_in(d, first + k * lengths_, lengths_));
  }

  void read_type(const std::string& d, Hdf5DataSet& data, std::size_t at = 0) const {
    const auto kind = number_in(d, at, 1) & 15, version = number_in(d, at, 1) >> 4;
    const auto bits = number_in(d, at + 1, 3);
    const auto size = number_in(d, at + 4, 4);
    if (at == 0) data.element = static_cast<std::size_t>(std::min<std::uint64_t>(size, 1 << 20));
    if (kind == 0 || kind == 1 || kind == 8) {  // 8: an enumeration, such as a truth value
      data.order = bits & 1 ? std::endian::big : std::endian::little;
      const bool is_signed = kind != 0 || bits & 8;
      if (kind == 1 && size == 4) data.type = Scalar::float32;
      if (kind == 1 && size == 8) data.type = Scalar::float64;
      if (kind == 0 && size == 1) data.type = is_signed ? Scalar::int8 : Scalar::uint8;
      if (kind == 0 && size == 2) data.type = is_signed ? Scalar::int16 : Scalar::uint16;
      if (kind == 0 && size == 4) data.type = is_signed ? Scalar::int32 : Scalar::uint32;
      if (kind == 0 && size == 8) data.type = is_signed ? Scalar::int64 : Scalar::uint64;
      if (kind == 8 && size == 1) data.type = Scalar::int8;
      if (kind != 8 && !data.type)
        data.unknown = "has numbers of " + std::to_string(8 * size) +
                       " bits, wanted 32 or 64 (save it as floats of 32 bits)";
    } else if (kind == 6) {
      data.unknown = "has a compound type, which is not read (save each of its columns alone)";
    } else if (kind == 10 && at == 0 && version >= 2) {  // a few numbers as one element
      const auto rank = number_in(d, 8, 1);
      const std::size_t dims = version == 2 ? 12 : 9;
      if (rank != 1) return;
      data.components = static_cast<std::size_t>(number_in(d, dims, 4));
      read_type(d, data, dims + (version == 2 ? 8 : 4));
      if (!data.type || data.components == 0 ||
          data.element / size_of(*data.type) != data.components)
        data.type.reset();
    }
    if (at == 0 && data.components == 1 && data.type && size_of(*data.type) != data.element)
      data.type.reset();
  }

  void read_layout(const std::string& d, Hdf5DataSet& data) const {
    const auto version = number_in(d, 0, 1);
    if (version != 3 && version != 4) {
      data.unknown = "has a layout of version " + std::to_string(version) +
                     " (save it with h5py's default libver)";
      return;
    }
    data.storage = static_cast<int>(number_in(d, 1, 1));
    if (data.storage == 0) {
      data.compact = d.substr(std::min<std::size_t>(4, d.size()),
                              static_cast<std::size_t>(number_in(d, 2, 2)));
    } else if (data.storage == 1) {
      data.address = number_in(d, 2, offsets_);
      data.size = number_in(d, 2 + offsets_, lengths_);
    } else if (data.storage == 2 && version == 3) {
      const auto rank = number_in(d, 2, 1);  // one more than the space's
      data.address = number_in(d, 3, offsets_);
      if (rank < 2 || rank > 33 || d.size() < 3 + offsets_ + 4 * rank) {
        data.unknown = "has chunks of a shape that is not known";
        return;
      }
      for (std::size_t k = 0; k + 1 < rank; ++k)
        data.chunk.push_back(number_in(d, 3 + offsets_ + 4 * k, 4));
    } else {
      data.unknown =
          "keeps its chunks in a way of later versions (save it with h5py's default "
          "libver)";
    }
  }

  void read_filters(const std::string& d, Hdf5DataSet& data) const {
    const auto version = number_in(d, 0, 1), count = number_in(d, 1, 1);
    std::size_t at = version == 1 ? 8 : 2;
    for (std::uint64_t k = 0; k < count && at < d.size(); ++k) {
      const int id = static_cast<int>(number_in(d, at, 2));
      at += 2;
      std::size_t name = 0;
      if (version == 1 || id >= 256) {
        name = static_cast<std::size_t>(number_in(d, at, 2));
        at += 2;
      }
      const auto values = static_cast<std::size_t>(number_in(d, at + 2, 2));
      at += 4 + (version == 1 ? rounded_up(name, 8) : name) + 4 * values;
      if (version == 1 && values % 2) at += 4;
      data.filters.push_back(id);
      if (id < 1 || id > 3)
        data.unknown = "is packed by filter " + std::to_string(id) +
                       ", wanted deflate, shuffle or fletcher32 (save it with gzip)";
    }
  }

  void read_link(const std::string& d, std::vector<Link>& links) const {
    const auto flags = number_in(d, 1, 1);
    std::size_t at = 2;
    const auto kind = flags & 8 ? number_in(d, at++, 1) : 0;
    if (flags & 4) at += 8;
    if (flags & 16) ++at;
    const std::size_t width = std::size_t{1} << (flags & 3);
    const auto length =
        static_cast<std::size_t>(std::min<std::uint64_t>(number_in(d, at, width), d.size()));
    at += width;
    if (kind != 0 || at > d.size() || length > d.size() - at) return;  // no hard link
    links.push_back({d.substr(at, length), number_in(d, at + length, offsets_)});
  }

  // A group of the first kind: a tree of lists of names in a heap.
  void read_symbols(std::uint64_t tree, std::uint64_t heap_address, std::vector<Link>& links) {
    const std::uint64_t heap = place(heap_address);
    if (text_or_nothing(heap, 4) != "HEAP") fail(*file_, "", "a group has no heap of names");
    const std::string names =
        text(place(number(heap + 8 + 2 * lengths_, offsets_)), number(heap + 8, lengths_));
    read_tree(tree, 0, names, links);
  }

  void read_tree(std::uint64_t at, std::size_t depth, const std::string& names,
                 std::vector<Link>& links) {
    if (depth > kDeepest || links.size() > kMostObjects)
      fail(*file_, "", "a group's tree of names never ends");
    const std::string mark = text_or_nothing(at, 4);
    if (mark == "TREE") {
      const auto level = number(at + 5, 1), count = number(at + 6, 2);
      // Keys and children in turn; only a child of a lower level is followed.
      const std::string entries = text(at + 8 + 2 * offsets_, count * (lengths_ + offsets_));
      for (std::size_t k = 0; k < count; ++k) {
        const std::uint64_t child =
            place(number_in(entries, k * (lengths_ + offsets_) + lengths_, offsets_));
        const bool leaf = text_or_nothing(child, 4) == "SNOD";
        if (!leaf && (level == 0 || number(child + 5, 1) >= level))
          fail(*file_, "", "a group's tree of names leads back into itself");
        if (++nodes_ > kMostObjects) fail(*file_, "", "a group's tree of names is too large");
        read_tree(child, depth + 1, names, links);
      }
    } else if (mark == "SNOD") {
      const auto count = number(at + 6, 2);
      const std::size_t entry = 2 * offsets_ + 24;
      const std::string entries = text(at + 8, count * entry);
      for (std::size_t k = 0; k < count; ++k) {
        const auto name = number_in(entries, k * entry, offsets_);
        if (name >= names.size()) continue;
        if (number_in(entries, k * entry + 2 * offsets_, 4) == 2) continue;  // a soft link
        links.push_back({std::string(names.c_str() + name),
                         number_in(entries, k * entry + offsets_, offsets_)});
      }
    } else {
      fail(*file_, byte_place(static_cast<std::size_t>(at)), "wanted a tree of names");
    }
  }

  std::shared_ptr<const Bytes> file_;
  Hdf5Objects objects_;
  std::size_t offsets_ = 8, lengths_ = 8;
  std::uint64_t base_ = 0;
  std::set<std::uint64_t> seen_;  // objects
  std::size_t nodes_ = 0;         // of trees of names
};

}  // namespace

Hdf5Objects hdf5_objects(const std::shared_ptr<const Bytes>& file) {
  return Reader(file).objects();
}

}  // namespace meniscus
