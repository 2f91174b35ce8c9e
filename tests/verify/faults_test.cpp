// The verifier itself: kernels with a fault planted in them must be caught, and named.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "io/temporary_folder.hpp"
#include "thrown.hpp"
#include "verify/record.hpp"
#include "verify/repro.hpp"
#include "verify/run.hpp"

namespace meniscus::verify {
namespace {

struct Fault {
  std::string name, file;
  std::string behind;    // the fault stands behind this text
  std::string from, to;  // what is replaced, once
  std::string kernel;    // that is to be named
  std::string stage;     // with it

  friend void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }
};

std::vector<Fault> faults() {
  return {
      // One unit in the last place, and roundings that a compiler might change.
      {"OneUlpOfANumber", "edges.cl", "kernel void measure_edges", "STOREF(found.number,",
       "STOREF(AS_FLOATV(AS_INTV(found.number) + 1),", "measure_edges", "fit"},
      {"AContractedProduct", "visible.cl", "kernel void cover_discs", "1.0f - (du * du + dv * dv)",
       "1.0f - fma(du, du, dv * dv)", "cover_discs", "visible"},
      {"AReassociatedSum", "edges.cl", "INLINED void sum_surroundings",
       "own->nx * p.dx + own->ny * p.dy + own->nz * p.dz",
       "own->nx * p.dx + (own->ny * p.dy + own->nz * p.dz)", "measure_edges", "fit"},
      {"AReciprocalForAQuotient", "density.cl", "inline floatv level_weight",
       "level / (level + (0.45f - level) * (t * t * (3.0f - 2.0f * t)))",
       "level * (1.0f / (level + (0.45f - level) * (t * t * (3.0f - 2.0f * t))))",
       "measure_gradients", ""},
      {"OneUlpOfTheDensity", "density.cl", "kernel void measure_gradients", "density = f.c * NORM",
       "density = f.c * (NORM * 1.0000001f)", "measure_gradients", ""},
      {"AnotherOrderOfFactors", "edges.cl", "INLINED void sum_surroundings", "w * apart * apart",
       "w * (apart * apart)", "measure_edges", ""},
      {"ALostFactorOfTheEvidence", "roundness.cl", "kernel void measure_evidence",
       "t.weight * t.f, t.f, squares", "t.weight, t.f, squares", "measure_evidence", ""},
      {"ABendThatSaysNothing", "sheet.cl", "kernel void score_bends",
       "bends * weight_of_bend(bend)", "bends", "score_bends", ""},
      {"TheLastBendsOfABlock", "sheet.cl", "kernel void set_roundness", "first < count;",
       "first + WIDTH <= count;", "set_roundness", ""},
      {"ATrialFitOfNoEdge", "roundness.cl", "kernel void place_models", "own.u * edge *", "edge *",
       "place_models", ""},
      {"OneUlpOfAMoment", "fit.cl", "#define CUBIC", "fma(s, c, fma(q, d##c, m[k]))",
       "fma(q, d##c, fma(s, c, m[k]))", "fit_particles", ""},
      {"AWrongCoefficientOfExp", "prelude.cl", "floatv exp_negative", "(1.0f / 720.0f)",
       "(1.0f / 720.1f)", "fit_particles", ""},
      {"OneUlpOfANormal", "paper.cl", "kernel void draw_spheres", "normal[s] = nx / size",
       "normal[s] = as_float(as_int(nx / size) + 1)", "draw_spheres", ""},
      // Off by one at odd sizes and at the ends of rows.
      {"TheLastOfAnOddNumberOfParticles", "bins.cl", "kernel void count_bins",
       "min(first + chunk, n)", "min(first + chunk, n - (n & 1))", "count_bins", ""},
      {"TheLastParticleOfTheBounds", "bins.cl", "kernel void bound_cells", "min(first + chunk, n)",
       "min(first + chunk, n - 1)", "bound_cells", ""},
      {"TheLastRowOfAColumn", "ssm.cl", "kernel void smooth_columns", "min(j, ny - 1 - j)",
       "min(j, ny - 2 - j)", "smooth_columns", ""},
      {"TheLastColumnsOfARow", "ssm.cl", "kernel void smooth_rows", "nx - 1 - place",
       "nx - 2 - place", "smooth_rows", ""},
      {"TheNeighbourBeyondTheRow", "ssm.cl", "kernel void depth_normals", "place == nx - 1",
       "place == nx", "depth_normals", ""},
      {"TheLastSampleOfAList", "list_samples.cl", "kernel void keep_samples",
       "listed = count[tile]", "listed = count[tile] - 1", "keep_samples", ""},
      {"TheLastRowOfABin", "visible.cl", "kernel void count_owned", "row < ROWS; ++row) least",
       "row < ROWS - 1; ++row) least", "count_owned", ""},
      // Lost ties.
      {"TheHigherIndexWinsATie", "visible.cl", "INLINED void draw_discs", "(p < owner[row])",
       "(p > owner[row])", "count_owned", ""},
      {"WhatIsNearlyATie", "minima.cl", "inline void draw_share", "(front == LOADF(depth + s))",
       "(front <= 1.001f * LOADF(depth + s))", "count_discs", ""},
      {"TheLastTriangleWinsATie", "paper.cl", "kernel void own_samples",
       "atomic_min(owner + j * samples.x + i, k)", "owner[j * samples.x + i] = k", "own_samples",
       ""},
      // Races: what was atomic is a read, a pause and a write (see with_pauses).
      {"ARaceOfCounts", "bins.cl", "inline int count_row", "atomic_inc(counts + i)",
       "RACE(counts[i], seen + 1)", "count_bins", ""},
      {"ARaceOfMinima", "bins.cl", "inline void lower_cells", "atomic_min(row + i, bits)",
       "RACE(row[i], min((uint)seen, bits))", "bound_cells", ""},
      {"ARaceOfPlaces", "bins.cl", "#if WIDTH == 1", "#define TAKE_NEXT(count) atomic_inc(count)",
       "#define TAKE_NEXT(count) take_next(count)\n"
       "inline int take_next(global int* count) { int next; RACE(*count, (next = seen) + 1); "
       "return next; }",
       "fill_bins", ""},
      // Rows of four: chunks' own counts and cells.
      {"TheFourthBinOfARow", "bins.cl", "#else\n#define TAKE_NEXT", "< number) & (nearest",
       "< min(number, i + 3)) & (nearest", "count_bins", ""},
      {"TheFourthCellOfARow", "bins.cl", "#else\n#define TAKE_NEXT", "(0, 1, 2, 3) < number;",
       "(0, 1, 2, 3) < min(number, i + 3);", "bound_cells", ""},
      {"TheLastChunk", "bins.cl", "kernel void sum_counts", "c < chunks", "c < chunks - 1",
       "sum_counts", ""},
      {"TheLastChunkOfTheBounds", "bins.cl", "kernel void least_bounds", "c < chunks",
       "c < chunks - 1", "least_bounds", ""},
      {"ARaceOfSums", "visible.cl", "kernel void count_owned", "atomic_add(owned + owner, number)",
       "RACE(owned[owner], seen + number)", "count_owned", ""},
      {"ARaceOfDepths", "minima.cl", "inline int move_to",
       "before = atomic_min(map + s, as_uint(depth))",
       "RACE(map[s], min((before = (uint)seen), as_uint(depth)))", "lower_discs", "visible"},
      {"ALostLane", "minima.cl", "inline int move_to", "lane < WIDTH; ++lane)",
       "lane < WIDTH - 1; ++lane)", "lower_discs", "visible"},
      {"ARaceOfFronts", "stream.cl", "kernel void find_fronts",
       "atomic_min(front + ((int)at.j[k] * map.nx + (int)at.i[k]), as_uint(at.depth[k]))",
       "RACE(front[(int)at.j[k] * map.nx + (int)at.i[k]], min((uint)seen, as_uint(at.depth[k])))",
       "find_fronts", "stream"},
      {"ARaceOfTheSelected", "stream.cl", "kernel void select_near",
       "const int place = atomic_add(selected_count, n)",
       "int place; RACE(*selected_count, (place = seen) + n)", "select_near", "stream"},
  };
}

std::string with_fault(const Fault& fault, const std::string& text) {
  const std::size_t behind = text.find(fault.behind);
  const std::size_t at = behind == std::string::npos ? behind : text.find(fault.from, behind);
  EXPECT_NE(at, std::string::npos) << fault.file << " has no longer what the fault replaces";
  if (at == std::string::npos) return text;
  return text.substr(0, at) + fault.to + text.substr(at + fault.from.size());
}

// A device with few processors at once may run a race for seconds without losing anything. So the
// first work-item of a group waits between reading and writing until another one has written there,
// as happens where thousands run in step, or until its group's share of some 30 ms is over: groups
// of small launches, too, run side by side then, however busy the machine is.
std::string with_pauses(const std::string& text) {
  return "#define RACE(at, value) \\\n"
         "  do { \\\n"
         "    const int seen = at; \\\n"
         "    const int groups = get_num_groups(0); \\\n"
         "    const int share = get_local_id(0) == 0 && groups > 1 ? (1 << 24) / groups : 0; \\\n"
         "    volatile global int* const now = (volatile global int*)&(at); \\\n"
         "    for (volatile int pause = 0; pause < max(share, 1000) && *now == seen; ++pause) {} "
         "\\\n"
         "    at = value; \\\n"
         "  } while (0)\n" +
         text;
}

std::string read_text(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// What a reproducer's README says in bold.
std::string verdict_of(const std::filesystem::path& folder) {
  const std::string text = read_text(folder / "README.md");
  const std::size_t begin = text.find("**") + 2;
  return text.substr(begin, text.find("**", begin) - begin);
}

// Builds a reproducer by itself and runs it. Returns its exit code and what it says.
std::pair<int, std::string> built_and_run(const std::filesystem::path& folder) {
  const std::string command =
      "cd '" + folder.string() + "' && make -s CC=cc CFLAGS=-O0 2>&1 && ./host '' 2000 2>&1";
  std::FILE* output = popen(command.c_str(), "r");
  std::string text;
  char part[4096];
  while (const std::size_t count = std::fread(part, 1, sizeof part, output))
    text.append(part, count);
  const int status = pclose(output);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

// The only reproducer in a folder, which says the same as `row` and shows it.
void expect_reproduced(const TemporaryFolder& folder, const Fault& fault, const Row& row) {
  ASSERT_EQ(folder.entries().size(), 1u) << "one folder, and nothing half-written";
  const std::filesystem::path own = folder.path() / folder.entries().front();
  EXPECT_THAT(own.filename().string(), testing::StartsWith(fault.kernel + "."));
  EXPECT_THAT(row.reason, testing::HasSubstr(own.string()));
  EXPECT_THAT(read_text(own / "README.md"), testing::Not(testing::HasSubstr("not known")));
  const std::string verdict = verdict_of(own);
  const auto [exit_code, said] = built_and_run(own);
  EXPECT_EQ(exit_code, 1) << said;
  // A race loses other values in every run, but values of the same argument.
  const bool races = fault.name.starts_with("ARace");
  EXPECT_THAT(said, testing::HasSubstr(races ? verdict.substr(0, verdict.find(':')) : verdict));
}

class Faults : public testing::TestWithParam<Fault> {};

TEST_P(Faults, AreCaughtAndNamed) {
  const Fault& fault = GetParam();
  Device device;
  device.state().kernel_text = [&](const std::string& file, const std::string& text) {
    return file == fault.file ? with_pauses(with_fault(fault, text)) : text;
  };
  Device healthy;  // knows the values of which there are only hashes
  const TemporaryFolder folder;
  Reproducers reproducers(folder.path().string(), device.info(),
                          [&](std::size_t k) { return k == 0 ? &healthy : nullptr; });
  Settings settings;
  settings.reproducers = &reproducers;
  if (!fault.kernel.empty()) settings.kernels = {fault.kernel};
  std::vector<Row> failed;
  // A race shows where two work-items meet, which is not every time: all cases and variants.
  for (const Item& item : items_of(settings, device.state().vector_width)) {
    run_item(item, device, [&](Row row) {
      if (row.result == Result::fail) failed.push_back(std::move(row));
    });
    if (!failed.empty()) break;
  }
  ASSERT_FALSE(failed.empty()) << "nobody noticed";
  const Row& first = failed.front();
  EXPECT_EQ(first.kernel, fault.kernel);
  EXPECT_THAT(first.reason, testing::HasSubstr("stage " + fault.stage));
  expect_reproduced(folder, fault, first);
}

INSTANTIATE_TEST_SUITE_P(Planted, Faults, testing::ValuesIn(faults()),
                         [](const auto& test) { return test.param.name; });

// Without a fault the same items find nothing.
TEST(Faults, NoneIsFoundWhereNoneIs) {
  Device device;
  Settings small;
  small.full = false;
  std::size_t passed = 0;
  for (const Item& item : items_of(small, device.state().vector_width))
    run_item(item, device, [&](const Row& row) {
      EXPECT_EQ(row.result, Result::pass) << row.kernel << " " << row.size << ": " << row.reason;
      ++passed;
    });
  EXPECT_GT(passed, 1000u);
}

// What is recorded is what all devices must compute from then on.
TEST(Recording, RefusesWhatIsFarFromDoublePrecision) {
  Device device;
  const Fault fault{"",
                    "visible.cl",
                    "INLINED void draw_discs",
                    "front = t - bulge * sqrt(",
                    "front = t + bulge * sqrt(",
                    "",
                    ""};
  device.state().kernel_text = [&](const std::string& file, const std::string& text) {
    return file == fault.file ? with_fault(fault, text) : text;
  };
  EXPECT_THAT(
      text_of_thrown<InvalidArgument>([&] { record_canonical(device, [](const std::string&) {}); }),
      testing::AllOf(testing::HasSubstr("of splat_depth is"),
                     testing::HasSubstr("off double precision")));
}

}  // namespace
}  // namespace meniscus::verify
