// VTK's XML files: the points of PolyData (.vtp) and of an UnstructuredGrid (.vtu), and the list of
// a time series (.pvd). Written from VTK's description of its file formats.
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/attribute_names.hpp"
#include "io/packed_array.hpp"
#include "io/readers.hpp"
#include "io/text_cursor.hpp"
#include "io/xml_scan.hpp"

namespace meniscus {
namespace {

constexpr std::string_view kAppended = "<AppendedData";
constexpr std::size_t kFirstHead = std::size_t{1} << 16;  // bytes that are looked at first

// The text before the appended data, or the whole file where there is none.
struct Head {
  std::string text;
  bool base64 = false;         // of the appended data
  std::uint64_t appended = 0;  // its first byte, behind the _; 0: there is none
};

Head read_head(const Bytes& file) {
  Head head;
  for (std::size_t size = kFirstHead;; size *= 4) {
    const std::size_t now = static_cast<std::size_t>(std::min<std::uint64_t>(size, file.size()));
    head.text = text_at(file, 0, now);
    const std::size_t found = head.text.find(kAppended);
    const std::size_t close = head.text.find('>', std::min(found, head.text.size()));
    const std::size_t mark = head.text.find_first_not_of(" \t\r\n", std::min(close, now - 1) + 1);
    if (found != std::string::npos && close != std::string::npos && mark != std::string::npos) {
      if (head.text[mark] != '_')
        fail(file, byte_place(mark),
             "found " + in_quotes(head.text.substr(mark, 1)) + ", wanted _ before appended data");
      const std::string_view tag = std::string_view(head.text).substr(found, close - found);
      head.base64 = tag.find("base64") != std::string_view::npos;
      head.appended = mark + 1;
      head.text.resize(found);
      return head;
    }
    if (now == file.size()) return head;
  }
}

constexpr std::pair<const char*, Scalar> kVtkXmlTypes[] = {
    {"int8", Scalar::int8},      {"uint8", Scalar::uint8},   {"int16", Scalar::int16},
    {"uint16", Scalar::uint16},  {"int32", Scalar::int32},   {"uint32", Scalar::uint32},
    {"int64", Scalar::int64},    {"uint64", Scalar::uint64}, {"float32", Scalar::float32},
    {"float64", Scalar::float64}};

std::uint64_t whole_number(const Bytes& file, const std::string& text, const std::string& what) {
  const auto value = parse_integer(text);
  if (!value || *value < 0)
    fail(file, "", "found " + in_quotes(text) + " for " + what + ", wanted a whole number >= 0");
  return static_cast<std::uint64_t>(*value);
}

// An array as its tag states it, and where its data is.
struct Stated {
  std::string name;
  bool is_unread = false;  // of texts or bits: never used
  Scalar type = Scalar::float32;
  std::size_t components = 1;
  std::string format;        // ascii, binary or appended
  std::uint64_t offset = 0;  // of appended data
  std::string_view text;     // of data in the file's own text
};

struct Piece {
  std::uint64_t points = 0;
  std::optional<Stated> positions;
  std::vector<Stated> arrays;  // of the points
};

class Reader {
 public:
  Reader(std::shared_ptr<const Bytes> file, const ReadOptions& options)
      : file_(std::move(file)), options_(options), head_(read_head(*file_)) {}

  Layout layout() {
    scan();
    std::vector<const Piece*> full;
    for (const Piece& piece : pieces_)
      if (piece.points > 0) full.push_back(&piece);
    if (full.size() > 1)
      fail(*file_, "",
           "holds " + std::to_string(full.size()) +
               " pieces with points, wanted one (save it as one piece)");
    if (pieces_.empty()) fail(*file_, "", "has no Piece (truncated?)");
    Layout layout = full.empty() ? layout_of(pieces_.front()) : layout_of(*full.front());
    layout.time = time_;
    layout.item = "point";
    return layout;
  }

 private:
  void scan() {
    XmlScan xml(head_.text, file_->name());
    std::vector<std::string> open;  // names of the elements around
    std::optional<Stated> array;
    std::size_t text_from = 0;
    bool is_vtk = false;
    while (const auto tag = xml.next()) {
      const std::string& name = tag->name;
      // What follows an array's values inside of it are keys about it.
      if (array && array->text.data() == nullptr)
        array->text = std::string_view(head_.text).substr(text_from, tag->at - text_from);
      if (tag->closes) {
        if (name == "DataArray" && array) {
          add(open, std::move(*array));
          array.reset();
        }
        while (!open.empty() && open.back() != name) open.pop_back();
        if (!open.empty()) open.pop_back();
        continue;
      }
      if (name == "VTKFile") {
        is_vtk = true;
        read_file_tag(*tag);
      } else if (!is_vtk) {
        fail(*file_, byte_place(tag->at), "found <" + shown(name) + ">, wanted <VTKFile>");
      } else if (name == "Piece") {
        Piece piece;
        piece.points =
            whole_number(*file_, tag->attribute("NumberOfPoints", "0"), "NumberOfPoints");
        pieces_.push_back(piece);
      } else if (name == "DataArray") {
        array = stated(*tag);
        text_from = tag->end;
        if (tag->is_empty) {
          add(open, std::move(*array));
          array.reset();
        }
      }
      if (!tag->is_empty) open.push_back(name);
      constexpr std::size_t kDeepest = 64;
      if (open.size() > kDeepest) fail(*file_, byte_place(tag->at), "its elements nest too deep");
    }
    if (!is_vtk) fail(*file_, "", "has no <VTKFile>");
    if (array) fail(*file_, "", "ends inside a DataArray (truncated?)");
    if (head_.appended == 0 && !open.empty())
      fail(*file_, "", "ends inside <" + shown(open.back()) + "> (truncated?)");
  }

  void read_file_tag(const XmlTag& tag) {
    const std::string type = lower_case(tag.attribute("type", ""));
    if (type != "polydata" && type != "unstructuredgrid")
      fail(*file_, "",
           "is a VTKFile of type " + in_quotes(tag.attribute("type", "")) +
               ", wanted PolyData or UnstructuredGrid");
    packing_.order = lower_case(tag.attribute("byte_order", "LittleEndian")) == "bigendian"
                         ? std::endian::big
                         : std::endian::little;
    const std::string header = lower_case(tag.attribute("header_type", "UInt32"));
    if (header != "uint32" && header != "uint64")
      fail(*file_, "", "found header_type " + in_quotes(header) + ", wanted UInt32 or UInt64");
    packing_.wide = header == "uint64";
    const std::string compressor = tag.attribute("compressor", "");
    packing_.zlib = lower_case(compressor) == "vtkzlibdatacompressor";
    if (!compressor.empty() && !packing_.zlib)
      fail(*file_, "",
           "is packed by " + in_quotes(compressor) +
               ", wanted vtkZLibDataCompressor (save it with that, or unpacked)");
  }

  Stated stated(const XmlTag& tag) {
    Stated array;
    array.name = tag.attribute("Name", "");
    array.format = lower_case(tag.attribute("format", "ascii"));
    if (array.format != "ascii" && array.format != "binary" && array.format != "appended")
      fail(*file_, byte_place(tag.at),
           "found format " + in_quotes(array.format) + ", wanted ascii, binary or appended");
    if (array.format == "appended" && tag.attribute("offset", "").empty())
      fail(*file_, byte_place(tag.at), "appended array " + shown(array.name) + " has no offset");
    array.offset = whole_number(*file_, tag.attribute("offset", "0"), "offset");
    const std::string type = tag.attribute("type", "");
    array.is_unread = lower_case(type) == "string" || lower_case(type) == "bit";
    if (array.is_unread) return array;
    const auto known = scalar_named(kVtkXmlTypes, lower_case(type));
    if (!known)
      fail(*file_, "",
           "found type " + in_quotes(type) + " of " + shown(array.name) + ", wanted a type of VTK");
    array.type = *known;
    array.components = static_cast<std::size_t>(
        whole_number(*file_, tag.attribute("NumberOfComponents", "1"), "NumberOfComponents"));
    if (array.components == 0) array.components = 1;
    constexpr std::size_t kMost = 4096;
    if (array.components > kMost)
      fail(*file_, byte_place(tag.at), shown(array.name) + " has too many components");
    return array;
  }

  void add(const std::vector<std::string>& open, Stated array) {
    if (array.is_unread) return;
    const auto inside = [&](const char* name) {
      return std::find(open.begin(), open.end(), name) != open.end();
    };
    if (inside("FieldData")) {
      const std::string name = lower_case(array.name);
      if (pieces_.empty() && (name == "timevalue" || name == "time")) read_time(array);
    } else if (pieces_.empty()) {
      return;
    } else if (inside("Points")) {
      if (!pieces_.back().positions) pieces_.back().positions = std::move(array);
    } else if (inside("PointData")) {
      pieces_.back().arrays.push_back(std::move(array));
    }
  }

  void read_time(const Stated& array) {
    const DataArray data = data_of(array, 1);
    if (data.components != 1 || data.bytes->size() < data.offset + size_of(data.type)) return;
    const std::string value = text_at(*data.bytes, data.offset, size_of(data.type));
    time_ = load_real<double>(value.data(), data.type, data.order);
  }

  DataArray data_of(const Stated& array, std::uint64_t tuples) {
    DataArray data{array.name, array.components,   array.type, packing_.order, nullptr, 0,
                   0,          size_of(array.type)};
    data.stride = array.components * size_of(array.type);
    const std::string place = "array " + shown(array.name);
    if (array.format == "ascii") {
      data.order = std::endian::native;
      data.bytes = numbers_of(*file_, array.text, array.type, place);
    } else if (array.format == "binary") {
      data.bytes = unpacked_inline(file_, array.text, packing_, place);
    } else if (head_.appended == 0) {
      fail(*file_, place, "is appended, but there is no AppendedData (truncated?)");
    } else if (head_.base64) {
      data.bytes = unpacked_base64(file_, head_.appended + array.offset, packing_,
                                   tuples * data.stride, place);
    } else {
      const RawPlace raw = unpacked_raw(file_, head_.appended + array.offset, packing_, place);
      data.bytes = raw.bytes;
      data.offset = raw.offset;
      if (raw.size / data.stride < tuples)
        fail(*file_, place,
             "has " + std::to_string(raw.size) + " bytes, wanted " + std::to_string(tuples) +
                 " x " + std::to_string(data.stride));
    }
    return data;
  }

  Layout layout_of(const Piece& piece) {
    const auto points = static_cast<std::int64_t>(piece.points);
    if (!piece.positions) {
      if (points > 0) fail(*file_, "", "has no Points (truncated?)");
      Layout none;
      none.particle_radius = options_.particle_radius;
      for (const std::string& name : options_.attributes) none.attributes.push_back(name);
      return none;
    }
    if (piece.positions->components != 3)
      fail(*file_, "",
           "its Points have " + std::to_string(piece.positions->components) +
               " components, wanted 3");
    // Data is fetched of those arrays alone that have a use.
    std::vector<DataArray> arrays{data_of(*piece.positions, piece.points)};
    arrays[0].name = "Points";
    std::vector<std::string> columns;
    for (const Stated& array : piece.arrays)
      columns.push_back(array.components == 1 ? array.name : "");
    const std::vector<Field> fields = fields_of_columns(columns);
    std::vector<NamedArray> named;
    for (const Stated& array : piece.arrays) named.push_back({array.name, array.components});
    std::vector<char> asked(named.size());
    for (const AttributePick& pick : pick_attributes(file_->name(), named, options_.attributes))
      asked[pick.array] = 1;
    bool has_velocity = false;
    for (std::size_t k = 0; k < piece.arrays.size(); ++k) {
      const Stated& array = piece.arrays[k];
      const bool velocity =
          array.components == 3 && field_of_attribute(array.name, 3) == Field::vx && !has_velocity;
      if (!asked[k] && fields[k] == Field::none && !velocity) continue;
      has_velocity |= velocity;
      arrays.push_back(data_of(array, piece.points));
    }
    return meniscus::layout_of(*file_, arrays, 0, points, options_);
  }

  std::shared_ptr<const Bytes> file_;
  const ReadOptions& options_;
  Head head_;
  Packing packing_;
  std::vector<Piece> pieces_;
  double time_ = 0;
};

}  // namespace

Layout vtk_xml_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options) {
  return Reader(file, options).layout();
}

std::vector<SeriesFrame> read_pvd(const InputFile& file) {
  XmlScan xml(file.bytes, file.name);
  std::vector<SeriesFrame> frames;
  bool is_vtk = false;
  while (const auto tag = xml.next()) {
    if (tag->closes) continue;
    if (tag->name == "VTKFile") {
      is_vtk = lower_case(tag->attribute("type", "")) == "collection";
      if (!is_vtk) fail(file, "", "is a VTKFile of another type, wanted Collection");
    }
    if (tag->name != "DataSet") continue;
    if (!is_vtk) fail(file, byte_place(tag->at), "found <DataSet>, wanted <VTKFile>");
    SeriesFrame frame;
    frame.file = tag->attribute("file", "");
    if (frame.file.empty()) fail(file, byte_place(tag->at), "a DataSet has no file");
    if (const auto time = parse_real(tag->attribute("timestep", "0"))) frame.time = *time;
    frames.push_back(std::move(frame));
  }
  if (!is_vtk) fail(file, "", "has no <VTKFile type=\"Collection\">");
  if (frames.empty()) fail(file, "", "lists no DataSet");
  return frames;
}

}  // namespace meniscus
