// Runs every kernel of every method on a tiny frame, in every vector width, in buffers that hold
// nonsense at first: what oclgrind is set to watch. Exits with 1 when a kernel was not run, a frame
// came out empty, or a result depends on the width or on the nonsense.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <regex>
#include <set>
#include <utility>

#include "device/device.hpp"
#include "device/kernel_sources.hpp"
#include "device/probe.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/whitewater.hpp"
#include "prepare/gather.hpp"
#include "same_bits.hpp"
#include "stages/frame/bins.hpp"
#include "verify/arithmetic.hpp"
#include "verify/scenes.hpp"

namespace {

unsigned char nonsense_byte;  // what new buffers are full of

}  // namespace

// The linker sends the library's calls here.
extern "C" cl_mem __real_clCreateBuffer(cl_context, cl_mem_flags, size_t, void*, cl_int*);
extern "C" cl_mem __wrap_clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size,
                                        void* host, cl_int* error) {
  if (host != nullptr) return __real_clCreateBuffer(context, flags, size, host, error);  // written
  const std::vector<unsigned char> bytes(size, nonsense_byte);
  return __real_clCreateBuffer(context, flags | CL_MEM_COPY_HOST_PTR, size,
                               const_cast<unsigned char*>(bytes.data()), error);
}

// And what the host writes for the device to read where it lies.
extern "C" void* __real_aligned_alloc(size_t alignment, size_t size);
extern "C" void* __wrap_aligned_alloc(size_t alignment, size_t size) {
  void* const bytes = __real_aligned_alloc(alignment, size);
  if (bytes != nullptr) std::memset(bytes, nonsense_byte, size);
  return bytes;
}

namespace {

using namespace meniscus;

std::set<std::string> embedded_kernels() {
  std::set<std::string> names;
  const std::regex head("kernel\\s+void\\s+(\\w+)");
  for (const KernelSource& source : kernel_sources()) {
    const std::string text(source.text);
    for (std::sregex_iterator match(text.begin(), text.end(), head), end; match != end; ++match)
      names.insert(std::string(source.file) + " " + (*match)[1].str());
  }
  return names;
}

}  // namespace

int main() try {
  // A block with a step and splash, 24 x 17 pixels.
  const verify::Scene& scene = verify::kernel_scenes().front();
  std::set<std::string> missing = embedded_kernels();
  bool good = true;
  std::map<Method, Surface> first;
  Surface first_closed;
  std::vector<WhitewaterMaps> first_white;
  for (const int width : {1, 8, 16}) {         // 16 where vectors of 16 are kept busy, else 8
    nonsense_byte = width == 1 ? 0x5a : 0xff;  // a large number; NaN and -1
    Device device;
    const bool slow = device.info().name.find("Oclgrind") != std::string::npos;
    if (slow && width == 8) continue;  // at 16 most kernels have 8 lanes, the others 16
    device.state().vector_width = std::min(width, 8);
    device.state().wide = width == 16;
    device.state().pool->reuse(false);  // every buffer is new, and full of nonsense
    // A minimum is looked at before it is lowered, which is a race to oclgrind and none that
    // matters.
    device.state().kernel_text = [](const std::string& file, const std::string& text) {
      return file == "minima.cl" ? "#define ATOMICS_ALONE\n" + text : text;
    };
    std::map<Method, Surface> by_minima;
    device.state().discs = DiscForm::minima;
    for (const Method method : {Method::fit, Method::paper, Method::spheres})
      if (width < 16)
        by_minima[method] =
            extract(device, scene.particles, scene.camera, verify::parameters_of(scene, method));
    device.state().discs = DiscForm::bins;
    for (const MethodEntry& entry : method_list()) {
      const Method method = entry.method;
      // Groups have the kernels of fit, which is compared at the other width.
      if (slow && method == Method::groups) continue;
      const bool known = slow && width == 1 && method == Method::fit;
      const Surface surface = known ? by_minima[method]
                                    : extract(device, scene.particles, scene.camera,
                                              verify::parameters_of(scene, method));
      std::size_t covered = 0;
      for (const float depth : surface.depth) covered += std::isfinite(depth);
      std::printf("%s, width %d: %zu pixels, %zu triangles\n", entry.name.c_str(), width, covered,
                  surface.mesh.triangle.size());
      good = good && covered > 0 && !surface.mesh.triangle.empty();
      if (!first.count(method)) first[method] = surface;
      if (!same_bits(first[method], surface)) {
        std::printf("%s: the result depends on the width or on unwritten memory\n",
                    entry.name.c_str());
        good = false;
      }
      if (by_minima.count(method) && !same_bits(by_minima[method], surface)) {
        std::printf("%s: the result depends on how discs are drawn\n", entry.name.c_str());
        good = false;
      }
    }
    // Oclgrind has the time for a few particles.
    Particles some = scene.particles;
    if (slow)
      for (std::vector<float>* const axis : {&some.x, &some.y, &some.z}) axis->resize(12);
    some.vx = some.vy = some.vz = some.radius = {};
    some.id = {};
    const Surface closed = extract_closed(device, some, {.cell = 4});
    std::printf("closed, width %d: %zu triangles\n", width, closed.mesh.triangle.size());
    good = good && !closed.mesh.triangle.empty();
    if (width == 1) first_closed = closed;
    if (!same_bits(first_closed, closed)) {
      std::printf("closed: the result depends on the width or on unwritten memory\n");
      good = false;
    }
    Surface white = first[Method::fit];
    const auto drops = source_of(some);  // on the surface and in it
    draw_whitewater(device,
                    {{WhitewaterType::foam, drops.get()}, {WhitewaterType::bubble, drops.get()}},
                    {}, white);
    if (width == 1) first_white = white.whitewater;
    for (std::size_t k = 0; k < first_white.size(); ++k) {
      const auto& seen = white.whitewater[k].density;
      good = good && std::any_of(seen.begin(), seen.end(), [](float share) { return share > 0; });
      if (same_bits(first_white[k], white.whitewater[k])) continue;
      std::printf("whitewater: the result depends on the width or on unwritten memory\n");
      good = false;
    }
    const auto source = source_of(scene.particles);
    const View view = make_view(scene.camera, 0.5, {0, 0, 0});
    const FrontMap map = find_fronts(device, view, *source, 64,
                                     {.cell = 2,
                                      .border = 4,
                                      .margin = 2,
                                      .block = 8,
                                      .around = 8,
                                      .reach = 4,
                                      .thickness = 0.8});
    select_near(device, view, *source, 64, map, {}, [](const auto&, const auto&) {});
    // What only larger frames need: large fills, particles in several chunks.
    auto staging = std::move(device.state().staging);  // a CPU has none
    filled(device, std::size_t{1} << 16, 1.0f);
    device.state().staging = std::move(staging);
    constexpr int kCovers = 1024;
    bound_bins(
        device,
        {filled<cl_int>(device, 4 * kCovers, 0), filled(device, kCovers, 1.0f), kCovers, kCovers},
        {9, 9, 0, 1}, 1);
    if (!slow || width == 1) {  // these do not depend on the width
      measure_roofline(device, {{1 << 12}, 1 << 7, 1, 1, 0});
      for (const auto& probe : {verify::probe_expressions, verify::probe_execution})
        probe(device, [&](const verify::Row& row) {
          if (row.result != verify::Result::fail || !row.required) return;
          std::printf("%s: %s\n", row.kernel.c_str(), row.reason.c_str());
          good = false;
        });
    }
    for (const auto& [key, kernel] : device.state().kernels) {
      missing.erase(kernel.file + " " + kernel.name);
    }
  }
  for (const std::string& name : missing) std::printf("not run: %s\n", name.c_str());
  return good && missing.empty() ? 0 : 1;
} catch (const std::exception& error) {
  std::printf("%s\n", error.what());
  return 1;
}
