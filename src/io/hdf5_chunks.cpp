#include "io/hdf5_chunks.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>

#include "io/array_bag.hpp"
#include "io/scalar.hpp"

namespace meniscus {
namespace {

struct Chunk {
  std::uint64_t at = 0, size = 0;  // in the file, bytes
  std::uint32_t skipped = 0;       // a bit for each filter that was not applied
};

class Chunks : public Bytes {
 public:
  Chunks(std::shared_ptr<const Bytes> file, std::string place, std::uint64_t base,
         std::size_t offsets, const std::vector<std::uint64_t>& shape,
         const std::vector<std::uint64_t>& chunk, std::size_t element, std::vector<int> filters)
      : file_(std::move(file)),
        place_(std::move(place)),
        base_(base),
        offsets_(offsets),
        element_(element),
        filters_(std::move(filters)) {
    if (chunk.size() != shape.size() || shape.empty())
      fail(*this, place_, "has chunks of another rank than its own");
    across_ = 1;
    for (std::size_t k = 1; k < shape.size(); ++k) across_ *= shape[k];
    for (std::size_t k = 0; k < chunk.size(); ++k)
      if (chunk[k] == 0) fail(*this, place_, "has chunks of no size");
    shape_ = shape;
    chunk_ = chunk;
    rows_ = chunk[0];
    constexpr std::uint64_t kMost = std::uint64_t{1} << 32;
    unpacked_ = element_;
    for (const std::uint64_t along : chunk)
      if (__builtin_mul_overflow(unpacked_, along, &unpacked_) || unpacked_ >= kMost)
        fail(*this, place_, "has chunks that are too large");
    row_ = across_ * element_;
    size_ = shape[0] * row_;
    check_unpacked(*file_, unpacked_, place_);
  }

  void index(std::uint64_t address) { walk(address, 0, UINT64_MAX); }

  std::uint64_t size() const override { return size_; }
  std::uint64_t block() const override { return rows_ * row_; }
  const std::string& name() const override { return file_->name(); }

  void read(std::uint64_t at, char* to, std::size_t size) const override {
    if (at > size_ || size > size_ - at) fail(*this, place_, "ends here (truncated?)");
    std::string bytes;  // of rows of chunks side by side
    while (size > 0) {
      const std::uint64_t row = at / row_, band = row / rows_;
      const std::uint64_t begin = band * rows_ * row_;
      const std::uint64_t end = std::min(begin + rows_ * row_, size_);
      unpack_band(band, bytes);
      const std::size_t now = static_cast<std::size_t>(std::min<std::uint64_t>(size, end - at));
      std::memcpy(to, bytes.data() + (at - begin), now);
      to += now;
      at += now;
      size -= now;
    }
  }

 private:
  std::uint64_t number(std::uint64_t at, std::size_t size) const {
    const std::string bytes = text_at(*file_, at, size);
    return size == 8   ? load<std::uint64_t>(bytes.data(), std::endian::little)
           : size == 4 ? load<std::uint32_t>(bytes.data(), std::endian::little)
           : size == 2 ? load<std::uint16_t>(bytes.data(), std::endian::little)
                       : static_cast<unsigned char>(bytes[0]);
  }
  std::uint64_t place(std::uint64_t address) const {
    std::uint64_t at = 0;
    if (__builtin_add_overflow(address, base_, &at) || at >= file_->size())
      fail(*this, place_, "its chunks lie beyond the file's end (truncated?)");
    return at;
  }

  // A tree of keys (size, skipped filters, offsets along each dimension) and children.
  void walk(std::uint64_t address, std::size_t depth, std::uint64_t above) {
    constexpr std::size_t kDeepest = 32;
    const std::uint64_t undefined = offsets_ == 4 ? 0xffffffffu : UINT64_MAX;
    if (address == undefined && depth == 0) return;  // nothing was written
    const std::uint64_t at = place(address);
    if (text_at(*file_, at, 4) != "TREE" || number(at + 4, 1) != 1)
      fail(*this, place_, "wanted the tree of its chunks at byte " + std::to_string(at));
    const std::uint64_t level = number(at + 5, 1), count = number(at + 6, 2);
    if (depth > kDeepest || level >= above)
      fail(*this, place_, "the tree of its chunks leads back into itself");
    const std::size_t rank = shape_.size(), key = 8 + 8 * (rank + 1), entry = key + offsets_;
    const std::string entries =
        text_at(*file_, at + 8 + 2 * offsets_, static_cast<std::size_t>(count) * entry);
    for (std::size_t k = 0; k < count; ++k) {
      const char* from = entries.data() + k * entry;
      const std::uint64_t child = offsets_ == 8
                                      ? load<std::uint64_t>(from + key, std::endian::little)
                                      : load<std::uint32_t>(from + key, std::endian::little);
      if (level > 0) {
        if (++nodes_ > file_->size() / 16) fail(*this, place_, "the tree of its chunks never ends");
        walk(child, depth + 1, level);
        continue;
      }
      Chunk chunk;
      chunk.size = load<std::uint32_t>(from, std::endian::little);
      chunk.skipped = load<std::uint32_t>(from + 4, std::endian::little);
      chunk.at = place(child);
      if (chunk.size > file_->size() - chunk.at)
        fail(*this, place_, "a chunk reaches beyond the file's end (truncated?)");
      std::vector<std::uint64_t> offset;
      for (std::size_t d = 0; d < rank; ++d)
        offset.push_back(load<std::uint64_t>(from + 8 + 8 * d, std::endian::little));
      chunks_[offset] = chunk;
    }
  }

  // All chunks of some rows, as whole rows. Of the rows that a chunk has beyond the data set's end
  // nothing is kept.
  void unpack_band(std::uint64_t band, std::string& bytes) const {
    const std::uint64_t first = band * rows_, rows = std::min(rows_, shape_[0] - first);
    bytes.assign(static_cast<std::size_t>(rows * row_), '\0');
    std::string values;
    std::vector<std::uint64_t> low(shape_.size(), 0);
    low[0] = first;
    std::uint64_t wanted = 1;  // chunks side by side
    for (std::size_t d = 1; d < shape_.size(); ++d)
      wanted *= shape_[d] / chunk_[d] + (shape_[d] % chunk_[d] != 0);
    const auto begin = chunks_.lower_bound(low);
    const auto end = std::find_if(begin, chunks_.end(),
                                  [&](const auto& chunk) { return chunk.first[0] != first; });
    if (static_cast<std::uint64_t>(std::distance(begin, end)) < wanted)
      fail(*this, place_,
           "holds no values for rows from " + std::to_string(first) +
               " on: none were ever written to them");
    for (auto it = begin; it != end; ++it) {
      unpack(it->second, values);
      // Rows of the chunk along the last dimension.
      const std::size_t last = shape_.size() - 1;
      const auto& offset = it->first;
      std::vector<std::uint64_t> p(shape_.size(), 0);  // in the chunk
      if (last == 0) {
        std::memcpy(bytes.data(), values.data(), static_cast<std::size_t>(rows * element_));
        continue;
      }
      const std::uint64_t columns =
          offset[last] < shape_[last] ? std::min(chunk_[last], shape_[last] - offset[last]) : 0;
      for (std::uint64_t done = 0;; ++done) {
        bool inside = p[0] < rows;
        std::uint64_t to = p[0], from = p[0];
        for (std::size_t d = 1; d <= last; ++d) {
          inside &= offset[d] < shape_[d] && p[d] < shape_[d] - offset[d];
          to = to * shape_[d] + offset[d] + p[d];
          from = from * chunk_[d] + p[d];
        }
        if (inside)
          std::memcpy(bytes.data() + to * element_, values.data() + from * element_,
                      static_cast<std::size_t>(columns * element_));
        std::size_t d = last;  // the next row: one on along the dimension before the last
        while (d-- > 0) {
          if (++p[d] < chunk_[d]) break;
          p[d] = 0;
        }
        if (d == static_cast<std::size_t>(-1)) break;
      }
    }
  }

  void unpack(const Chunk& chunk, std::string& values) const {
    values = text_at(*file_, chunk.at, static_cast<std::size_t>(chunk.size));
    const std::size_t whole = static_cast<std::size_t>(unpacked_);
    for (std::size_t k = filters_.size(); k-- > 0;) {
      if (k < 32 && chunk.skipped >> k & 1) continue;
      if (filters_[k] == 3) {  // a checksum, which deflate has one of, too
        if (values.size() < 4) fail(*this, place_, "a chunk is cut off");
        values.resize(values.size() - 4);
      } else if (filters_[k] == 1) {
        // Filters before it keep the size, or add a checksum.
        std::size_t size = whole;
        for (std::size_t f = 0; f < k; ++f)
          if (filters_[f] == 3 && !(f < 32 && chunk.skipped >> f & 1)) size += 4;
        if (!can_unpack_to(values.size(), size))
          fail(*this, place_, "a chunk states more bytes than it can become");
        std::string unpacked(size, '\0');
        inflate_to(values, false, unpacked.data(), size, *this, place_);
        values.swap(unpacked);
      } else {
        const std::size_t count = values.size() / element_;
        std::string ordered = values;
        for (std::size_t i = 0; i < count; ++i)
          for (std::size_t b = 0; b < element_; ++b)
            ordered[i * element_ + b] = values[b * count + i];
        values.swap(ordered);
      }
    }
    if (values.size() != whole)
      fail(*this, place_,
           "a chunk has " + std::to_string(values.size()) + " bytes, wanted " +
               std::to_string(whole));
  }

  std::shared_ptr<const Bytes> file_;
  std::string place_;
  std::uint64_t base_ = 0;
  std::size_t offsets_ = 8, element_ = 1;
  std::vector<int> filters_;
  std::vector<std::uint64_t> shape_, chunk_;
  std::uint64_t across_ = 1, row_ = 1, rows_ = 1;       // elements, bytes; rows of a chunk
  std::uint64_t size_ = 0, unpacked_ = 0;               // bytes of all, and of a chunk
  std::size_t nodes_ = 0;                               // of the tree
  std::map<std::vector<std::uint64_t>, Chunk> chunks_;  // by their first element
};

}  // namespace

std::shared_ptr<const Bytes> hdf5_chunks(const std::shared_ptr<const Bytes>& file,
                                         const std::string& place, std::uint64_t base,
                                         std::uint64_t tree, std::size_t offsets,
                                         const std::vector<std::uint64_t>& shape,
                                         const std::vector<std::uint64_t>& chunk,
                                         std::size_t element, const std::vector<int>& filters) {
  auto chunks =
      std::make_shared<Chunks>(file, place, base, offsets, shape, chunk, element, filters);
  chunks->index(tree);
  return chunks;
}

}  // namespace meniscus
