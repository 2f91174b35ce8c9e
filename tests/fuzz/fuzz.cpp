// Feeds what reads files with bytes of libFuzzer's making.
//   meniscus_fuzz --entry=NAME [libFuzzer's options] [CORPUS ...]
// Anything but a result that fits together or an InputError is a fault.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "fuzz/mutate.hpp"
#include "fuzz/particle_entries.hpp"
#include "io/preview.hpp"
#include "io/readers.hpp"
#include "io/rows.hpp"
#include "kernels/page.hpp"
#include "kernels/table.hpp"
#include "meniscus/io.hpp"
#include "program/batch/contact_sheet.hpp"
#include "program/batch/report.hpp"
#include "verify/page.hpp"
#include "verify/results.hpp"

namespace meniscus::fuzz {
namespace {

constexpr std::size_t kHead = std::size_t{1} << 16;  // what ply_rows gets of a file

// For readers that take a path: a file in memory.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& bytes) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    want(descriptor_ >= 0 &&
             write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
         "no file in memory can be made");
  }
  ~MemoryFile() { close(descriptor_); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

// The rows that are left on disk are those that read_ply reads.
void rows(const std::string& bytes) {
  const auto layout = ply_rows({"f.ply", bytes.substr(0, kHead)}, bytes.size());
  if (!layout) return;
  const auto count = static_cast<std::size_t>(layout->count);
  want(layout->count >= 0 && layout->stride > 0 && layout->offset <= bytes.size() &&
           count <= (bytes.size() - layout->offset) / layout->stride,
       "rows beyond the end of the file");
  const Particles all = read_ply({"f.ply", bytes}, {});
  want(all.size() == count, "another number of particles");
  for (const auto& column : layout->columns) {
    want(column.offset + size_of(column.type) <= layout->stride, "a column beyond its row");
    if (column.field == Field::id || column.field == Field::none) continue;
    const std::vector<float>& values = array_of(const_cast<Particles&>(all), column.field);
    for (std::size_t k = 0; k < count; ++k) {
      const float value =
          load_real<float>(bytes.data() + layout->offset + k * layout->stride + column.offset,
                           column.type, layout->order);
      want(std::memcmp(&value, &values[k], sizeof value) == 0, "other values");
    }
  }
}

void camera(const std::string& bytes) {
  const MemoryFile file(bytes);
  for (const auto& [frame, camera] : read_cameras(file.path()))
    want(frame >= kEveryFrame && frame <= kLastFrame && camera.width > 0 && camera.height > 0,
         "a camera that cannot be");
}

// As `report` reads pictures.
void exr(const std::string& bytes) {
  const MemoryFile file(bytes);
  const Surface surface = read_exr(file.path());
  if (surface.normal.empty()) return;
  const RgbImage small = shrunk(
      {surface.camera.width, surface.camera.height, draw_preview(surface, Preview::lit)}, 16);
  want(small.bytes.size() == 3u * static_cast<std::size_t>(small.width * small.height),
       "a picture of another size");
}

void png(const std::string& bytes) {
  const MemoryFile file(bytes);
  const RgbImage small = shrunk(read_png(file.path()), 16);
  want(small.bytes.size() == 3u * static_cast<std::size_t>(small.width * small.height),
       "a picture of another size");
}

void log(const std::string& bytes) {
  const MemoryFile file(bytes);
  std::string note;
  std::vector<FrameRecord> records = read_log(file.path(), &note);
  // Pictures have entries of their own, and those that a log names lie anywhere.
  for (FrameRecord& record : records) record.outputs.clear();
  const BatchReport report = merge_records(records);
  want(!to_html(report).empty(), "an empty page");
  for (const FrameRecord& record : records) {
    const MemoryFile again(to_json(record) + "\n");
    want(read_log(again.path(), &note).size() == 1, "a record that does not read back");
  }
}

void verify(const std::string& bytes) {
  const meniscus::verify::VerifyRun run = meniscus::verify::run_from_json(bytes, "f.json");
  to_html(run);
  to_junit(run);
  table_of(run);
  if (run.devices.size() > 1) comparison_of(run.devices[0], run.devices[1]);
  const auto again = meniscus::verify::run_from_json(to_json(run), "again.json");
  want(again.devices.size() == run.devices.size(), "a run that does not read back");
}

void bench(const std::string& bytes) {
  const meniscus::bench::BenchRun run = meniscus::bench::from_json(bytes, "f.json");
  results_table(run);
  verdict_table(run);
  const auto pairs = pair_sessions(nullptr, run);
  comparison_table(pairs);
  comparison_table(pair_sessions(&run, run));
  to_html(run, pairs);
}

enum class Format { any, ply, json, lines, png };

struct Entry {
  const char* name;
  Format format;
  const char* particles;                       // the name of a file of them, or
  void (*read)(const std::string&) = nullptr;  // what else is read
};

const Entry kEntries[] = {
    {"ply", Format::ply, "f.ply"},           {"rows", Format::ply, nullptr, rows},
    {"vtk", Format::any, "f.vtk"},           {"bgeo", Format::any, "f.bgeo"},
    {"xyz", Format::any, "f.xyz"},           {"csv", Format::any, "f.csv"},
    {"vtp", Format::any, "f.vtp"},           {"npy", Format::any, "f.npy"},
    {"npz", Format::any, "f.npz"},           {"hdf5", Format::any, "f.h5"},
    {"bgeo_json", Format::any, "f.bgeo"},    {"bgeo_sc", Format::any, "f.bgeo.sc"},
    {"bi4", Format::any, "f.bi4"},           {"ffp3", Format::any, "f.ffp3"},
    {"lammps", Format::any, "f.dump"},
#ifdef MENISCUS_OPENVDB
    {"vdb", Format::any, "f.vdb"},  // by itself: OpenVDB 10 is not made for damaged files
#endif
    {"pvd", Format::any, nullptr, series},   {"camera", Format::json, nullptr, camera},
    {"exr", Format::any, nullptr, exr},      {"png", Format::png, nullptr, png},
    {"log", Format::lines, nullptr, log},    {"verify", Format::json, nullptr, verify},
    {"bench", Format::json, nullptr, bench},
};

const Entry* chosen = nullptr;

}  // namespace
}  // namespace meniscus::fuzz

using namespace meniscus::fuzz;

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  const std::string_view option = "--entry=";
  for (int k = 1; k < *count; ++k) {
    const std::string_view argument = (*arguments)[k];
    if (!argument.starts_with(option)) continue;
    for (const Entry& entry : kEntries)
      if (argument.substr(option.size()) == entry.name) chosen = &entry;
  }
  if (chosen) return 0;
  std::fprintf(stderr, "meniscus_fuzz: wanted --entry= one of");
  for (const Entry& entry : kEntries) std::fprintf(stderr, " %s", entry.name);
  std::fprintf(stderr, "\n");
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;  // read_file refuses an empty file
  try {
    const std::string bytes(reinterpret_cast<const char*>(data), size);
    chosen->particles ? particles(chosen->particles, bytes) : chosen->read(bytes);
  } catch (const meniscus::InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned int seed) {
  Random random(seed + 1);
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  std::string mutated;
  switch (chosen->format) {
    case Format::any:
      mutated = any_mutation(bytes, most);
      break;
    case Format::ply:
      mutated = mutate_ply(bytes, most, random);
      break;
    case Format::json:
    case Format::lines:
      mutated = mutate_json(bytes, most, chosen->format == Format::lines, random);
      break;
    case Format::png:
      mutated = mutate_png(bytes, most);
      break;
  }
  std::copy(mutated.begin(), mutated.end(), data);
  return mutated.size();
}
