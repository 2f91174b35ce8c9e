// Measuring real frames and sequences.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "accuracy/commands.hpp"
#include "accuracy/error_map.hpp"
#include "accuracy/figures/flicker.hpp"
#include "accuracy/mesh_file.hpp"
#include "accuracy/ray_cast.hpp"
#include "accuracy/real.hpp"
#include "base/elapsed.hpp"
#include "enclosing_camera.hpp"
#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

namespace fs = std::filesystem;

constexpr double kDriftStep = 0.05;  // s; RMS path of a particle from frame to frame
constexpr int kDriftFrames = 5;

/// Particles and camera in units of s.
struct Frame {
  Particles particles;
  Lens lens;
  double unit = 1;  // world units
};

/// What one method gives on one frame or sequence.
struct RealRow {
  std::string input, method;
  Agreement agreement;
  Flicker drift, drift_normal, sequence, sequence_normal;
  double seconds = 0;
};

const std::vector<std::pair<Quantity, double (*)(const RealRow&)>>& real_figures() {
  using R = const RealRow&;
  static const std::vector<std::pair<Quantity, double (*)(R)>> figures{
      {{"angle_median", "°", 2, Better::low,
        "Angle between the map's normals and the reference's, on smooth parts, median."},
       [](R row) { return row.agreement.angle_median; }},
      {{"angle_p95", "°", 2, Better::low, "The same angle, 95th percentile."},
       [](R row) { return row.agreement.angle_p95; }},
      {{"all_median", "°", 2, Better::low,
        "The same angle wherever both depths lie within 1.5 s (3 r), median."},
       [](R row) { return row.agreement.all_median; }},
      {{"all_p95", "°", 2, Better::low, "The same, 95th percentile."},
       [](R row) { return row.agreement.all_p95; }},
      {{"jump_p999", "°", 2, Better::low,
        "Angle between neighbouring pixels' normals beyond the reference's, on smooth parts, "
        "99.9th "
        "percentile."},
       [](R row) { return row.agreement.jump_p999; }},
      {{"smooth_share", "%", 1, Better::neither, "Share of the compared pixels on smooth parts."},
       [](R row) { return row.agreement.smooth_share; }},
      {{"iou", "", 4, Better::neither,
        "Pixels covered in both over pixels covered in either; the reference is no truth, and "
        "shrinks outlines."},
       [](R row) { return row.agreement.iou; }},
      {{"drift", "s", 4, Better::low,
        "Second difference of the depths in time while all particles move on along their "
        "velocities by 0.05 s a frame (RMS): smooth motion has none."},
       [](R row) { return row.drift.rms; }},
      {{"drift_p999", "s", 4, Better::low, "The same, 99.9th percentile: pops."},
       [](R row) { return row.drift.p999; }},
      {{"drift_normal", "s", 4, Better::low,
        "The second difference of drift along the surface's normal (RMS): grazing rays do not "
        "magnify it."},
       [](R row) { return row.drift_normal.rms; }},
      {{"drift_normal_p999", "s", 4, Better::low, "The same, 99.9th percentile."},
       [](R row) { return row.drift_normal.p999; }},
      {{"sequence", "s", 4, Better::low,
        "Second difference of the depths in time over the frames of the simulation; most of it is "
        "the motion itself."},
       [](R row) { return row.sequence.rms; }},
      {{"sequence_p999", "s", 4, Better::low, "The same, 99.9th percentile."},
       [](R row) { return row.sequence.p999; }},
      {{"sequence_normal", "s", 4, Better::low,
        "The second difference of sequence along the surface's normal (RMS)."},
       [](R row) { return row.sequence_normal.rms; }},
      {{"time", "ms", 0, Better::low,
        "Wall time of extracting a frame, on this machine: the shortest of the drift's, the mean "
        "over a sequence."},
       [](R row) { return 1000 * row.seconds; }},
  };
  return figures;
}

/// The camera of the options, else the camera.json beside the frame, else one that shows it all.
Camera camera_for(const RealOptions& options, const std::string& path, const Particles& particles) {
  if (!options.camera.empty()) return read_camera(options.camera);
  if (!options.eye.empty()) {
    const auto triple = [](const std::vector<double>& v) {
      return std::array<double, 3>{v[0], v[1], v[2]};
    };
    return look_at(triple(options.eye), triple(options.target), triple(options.up), options.fov,
                   options.width, options.height);
  }
  const fs::path beside = fs::path(path).parent_path() / "camera.json";
  if (fs::exists(beside)) return read_camera(beside.string());
  return enclosing_camera(particles, options.width, options.height);
}

Frame read_frame(const RealOptions& options, const std::string& path) {
  const Particles particles = read_particles(path, options.particle_radius);
  require(particles.particle_radius > 0,
          path + ": states no particle radius (give --particle-radius)");
  const double unit = 2 * particles.particle_radius;
  return {in_units(particles, unit), lens_of(camera_for(options, path, particles), unit), unit};
}

/// The particle files of a folder, by name.
std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() != ".json")
      files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

Map map_of(const Surface& surface) { return {surface.depth, surface.normal}; }

/// Extracts and takes the time.
Surface timed(const Contender& contender, const Frame& frame, double& seconds) {
  const auto start = std::chrono::steady_clock::now();
  Surface surface = contender.extract(frame.particles, frame.lens);
  seconds = seconds_since(start);
  return surface;
}

/// Maps of the frame and of what it drifts to; only the first one where there are no velocities.
/// `seconds` is that of the first and becomes the shortest of all: the first loads the kernels.
std::vector<Map> drift_of(const Contender& contender, const Frame& frame, const Map& first,
                          double& seconds) {
  const double speed = rms_speed(frame.particles);
  std::vector<Map> maps{first};
  for (int k = 1; k < kDriftFrames && speed > 0; ++k) {
    const Frame moved{drifted(frame.particles, k * kDriftStep / speed), frame.lens, frame.unit};
    double taken = 0;
    maps.push_back(map_of(timed(contender, moved, taken)));
    seconds = std::min(seconds, taken);
  }
  return maps;
}

struct Gathered {
  std::vector<RealRow> rows;
  Gallery gallery;
};

void measure_frame(const std::vector<Contender>& contenders, const CommonOptions& common,
                   const RealOptions& options, const std::string& path, Gathered& gathered) {
  const Frame frame = read_frame(options, path);
  const std::string name = fs::path(path).parent_path().filename() / fs::path(path).stem();
  Map reference;
  if (options.reference.empty()) {
    reference = map_of(splashsurf(common.splashsurf).extract(frame.particles, frame.lens));
  } else if (options.reference != "none") {
    Mesh mesh = read_mesh(options.reference);
    for (Vec3& v : mesh.position) v = static_cast<Vec3>(Vec3d(v) / frame.unit);
    reference = ray_cast(mesh, frame.lens);
  }
  Gallery::Row pictures{name, {}};
  const auto show = [&](const std::string& caption, const Surface& surface) {
    if (common.html.empty()) return;
    pictures.cells.push_back(
        {caption, picture_of(surface, Preview::lit), picture_of(surface, Preview::normal)});
  };
  for (const Contender& contender : contenders) {
    RealRow row{name, contender.name, {}, {}, {}, {}, {}, 0};
    const Surface surface = timed(contender, frame, row.seconds);
    const bool is_reference = options.reference.empty() && contender.name == "splashsurf";
    if (!reference.depth.empty() && !is_reference)
      row.agreement = agreement(frame.lens, reference, map_of(surface));
    const std::vector<Map> maps = drift_of(contender, frame, map_of(surface), row.seconds);
    row.drift = second_difference(maps);
    row.drift_normal = second_difference_along_normal(frame.lens, maps);
    gathered.rows.push_back(row);
    show(contender.name, surface);
    if (!common.pictures.empty()) {
      std::string stem = common.pictures + "/" + name + "_" + contender.name;
      std::replace(stem.begin() + static_cast<long>(common.pictures.size()) + 1, stem.end(), '/',
                   '_');
      write_png(stem + "_lit.png", surface, Preview::lit);
      write_png(stem + "_normal.png", surface, Preview::normal);
      const Bytes changes = change_map(frame.lens, maps);
      write_file(stem + "_drift.png", changes.data(), changes.size());
    }
  }
  if (!reference.depth.empty() && (contenders.empty() || contenders.back().name != "splashsurf"))
    show("the reference", surface_of(frame.lens, reference, kParticleRadius));
  gathered.gallery.rows.push_back(std::move(pictures));
}

void measure_sequence(const std::vector<Contender>& contenders, const RealOptions& options,
                      const std::string& folder, Gathered& gathered) {
  std::vector<std::string> files = files_in(folder);
  require(files.size() >= 3,
          folder + ": holds " + std::to_string(files.size()) + " frames, wanted at least three");
  std::vector<Frame> frames;
  for (const std::string& file : files) frames.push_back(read_frame(options, file));
  const Lens lens = frames[frames.size() / 2].lens;  // one camera for all
  for (const Contender& contender : contenders) {
    RealRow row{fs::path(folder).lexically_normal().filename().empty()
                    ? fs::path(folder).lexically_normal().parent_path().filename().string()
                    : fs::path(folder).lexically_normal().filename().string(),
                contender.name,
                {},
                {},
                {},
                {},
                {},
                0};
    std::vector<Map> maps;
    for (Frame& frame : frames) {
      frame.lens = lens;
      double seconds = 0;
      maps.push_back(map_of(timed(contender, frame, seconds)));
      row.seconds += seconds / static_cast<double>(frames.size());
    }
    row.sequence = second_difference(maps);
    row.sequence_normal = second_difference_along_normal(lens, maps);
    gathered.rows.push_back(row);
  }
}

std::vector<Table> tables_of(const std::vector<RealRow>& rows) {
  std::vector<Table> tables;
  for (const RealRow& row : rows) {
    if (tables.empty() || tables.back().title != row.input) {
      tables.push_back({row.input, "", {}, {}, "figure"});
      for (const auto& [quantity, value] : real_figures())
        tables.back().lines.push_back({quantity, {}});
    }
    tables.back().columns.push_back(row.method);
    for (std::size_t k = 0; k < real_figures().size(); ++k)
      tables.back().lines[k].values.push_back(real_figures()[k].second(row));
  }
  for (Table& table : tables)
    std::erase_if(table.lines, [](const Table::Line& line) {
      return std::all_of(line.values.begin(), line.values.end(),
                         [](double value) { return std::isnan(value); });
    });
  return tables;
}

nlohmann::json to_json(const RealRow& row) {
  nlohmann::json figures;
  for (const auto& [quantity, value] : real_figures()) {
    const double number = value(row);
    figures[quantity.name] = std::isnan(number) ? nlohmann::json() : nlohmann::json(number);
  }
  return {{"input", row.input}, {"method", row.method}, {"figures", std::move(figures)}};
}

}  // namespace

void run_real(const CommonOptions& common, const RealOptions& options) {
  Device device(common.device);
  const std::vector<Contender> contenders = contenders_of(common, device);
  if (!common.pictures.empty()) fs::create_directories(common.pictures);
  Gathered gathered;
  for (const std::string& input : options.inputs)
    if (fs::is_directory(input))
      measure_sequence(contenders, options, input, gathered);
    else
      measure_frame(contenders, common, options, input, gathered);

  Report report;
  report.title = "Meniscus on real frames";
  report.introduction =
      "Frames of simulations have no truth. The reference is the mesh of splashsurf with its "
      "smooth settings, seen by the same camera, unless another one was given: it sees all "
      "particles and smooths over many of them. Lengths are in s, the particle spacing: two "
      "particle radii.";
  report.facts = {{"version", version()}, {"device", device.info().name}};
  report.tables = tables_of(gathered.rows);
  std::erase_if(gathered.gallery.rows, [](const auto& row) { return row.cells.empty(); });
  if (!gathered.gallery.rows.empty()) {
    gathered.gallery.title = "The surfaces";
    gathered.gallery.note = "Click a picture to enlarge it; arrow keys compare it with the next.";
    gathered.gallery.first_kind = "lit";
    gathered.gallery.second_kind = "normals";
    report.galleries.push_back(std::move(gathered.gallery));
  }
  nlohmann::json document{{"version", version()}, {"device", device.info().name}};
  for (const RealRow& row : gathered.rows) document["rows"].push_back(to_json(row));
  std::fputs(markdown(report).c_str(), stdout);
  write_results(common, document.dump(1) + "\n", report);
}

}  // namespace meniscus::accuracy
