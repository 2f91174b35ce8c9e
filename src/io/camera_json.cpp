#include <cstdint>
#include <map>

#include "io/input_file.hpp"
#include "io/json_number.hpp"
#include "io/json_text.hpp"
#include "io/readers.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

using nlohmann::json;

const json& entry(const InputFile& file, const json& root, const char* key) {
  const auto found = root.find(key);
  if (found == root.end())
    fail(file, "",
         std::string("has no key \"") + key + "\", wanted width, height, view, projection");
  return *found;
}

int read_side(const InputFile& file, const json& root, const char* key) {
  const json& value = entry(file, root, key);
  const auto pixels = whole_number<int>(value);
  if (!pixels)
    fail(file, key, "found " + in_quotes_of(value) + ", wanted a whole number of pixels");
  return *pixels;
}

std::array<double, 16> read_matrix(const InputFile& file, const json& root, const char* key) {
  const json& rows = entry(file, root, key);
  if (!rows.is_array() || rows.size() != 4)
    fail(file, key, "found " + in_quotes_of(rows) + ", wanted 4 rows of 4 numbers");
  std::array<double, 16> matrix{};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::string row = "row " + std::to_string(i);
    if (!rows[i].is_array() || rows[i].size() != 4)
      fail(file, std::string(key) + ": " + row,
           "found " + in_quotes_of(rows[i]) + ", wanted 4 numbers");
    for (std::size_t j = 0; j < 4; ++j) {
      if (!rows[i][j].is_number())
        fail(file, std::string(key) + ": " + row + ", column " + std::to_string(j),
             "found " + in_quotes_of(rows[i][j]) + ", wanted a number");
      matrix[4 * i + j] = rows[i][j].get<double>();
    }
  }
  return matrix;
}

json parse(const InputFile& file) {
  try {
    return parse_json<json>(file.bytes);
  } catch (const InputError& error) {
    fail(file, "", std::string("is not JSON: ") + error.what());
  }
}

/// `file` names the camera's place in messages.
Camera read_object(const InputFile& file, const json& root) {
  if (!root.is_object())
    fail(file, "",
         "found " + in_quotes_of(root) +
             ", wanted {\"width\": ..., \"height\": ..., \"view\": ..., \"projection\": ...}" +
             (root.is_array() ? " (a list of cameras is for a sequence)" : ""));
  Camera camera;
  camera.width = read_side(file, root, "width");
  camera.height = read_side(file, root, "height");
  camera.view = read_matrix(file, root, "view");
  camera.projection = read_matrix(file, root, "projection");
  try {
    check(camera);
  } catch (const InvalidArgument& error) {
    fail(file, "", error.what());
  }
  return camera;
}

}  // namespace

Camera camera_of(const InputFile& file) { return read_object(file, parse(file)); }

Camera read_camera(const std::string& path) { return camera_of(read_file(path)); }

std::map<std::int64_t, Camera> read_cameras(const std::string& path) {
  const InputFile file = read_file(path);
  const json root = parse(file);
  if (!root.is_array()) return {{kEveryFrame, read_object(file, root)}};
  if (root.empty()) fail(file, "", "the list of cameras is empty");
  std::map<std::int64_t, Camera> cameras;
  for (std::size_t k = 0; k < root.size(); ++k) {
    const InputFile place{path + ": camera " + std::to_string(k), {}};
    const auto frame = root[k].find("frame");
    if (!root[k].is_object() || frame == root[k].end() || !frame->is_number() ||
        frame->get<double>() < 0)
      fail(place, "", "has no key \"frame\" with a whole number >= 0");
    const auto number = whole_number<std::int64_t>(*frame);
    if (!number || *number > kLastFrame)
      fail(place, "",
           "frame is " + frame->dump() + ", must be a whole number from 0 to " +
               std::to_string(kLastFrame));
    const Camera camera = read_object(place, root[k]);
    if (!cameras.emplace(*number, camera).second)
      fail(place, "", "is the second one of frame " + frame->dump());
  }
  return cameras;
}

}  // namespace meniscus
