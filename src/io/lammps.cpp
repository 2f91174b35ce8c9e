// LAMMPS' text dumps (dump custom, dump atom): one or several timesteps, each with its box and a
// table of atoms. Written from the manual's page on the command dump.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/attribute_names.hpp"
#include "io/readers.hpp"
#include "io/text_cursor.hpp"

namespace meniscus {
namespace {

struct Box {
  std::array<double, 3> low{}, high{};
  double xy = 0, xz = 0, yz = 0;  // how the box is tilted
};

// How a coordinate of the table becomes one of the world.
struct Axis {
  std::size_t column = 0;
  bool scaled = false;  // a share of the box
};

class Reader {
 public:
  Reader(const InputFile& file, const ReadOptions& options)
      : file_(file), options_(options), cursor_(file) {}

  Particles read() {
    std::vector<std::int64_t> steps;
    std::optional<Particles> wanted;
    for (auto line = next(); line; line = next()) {
      if (line->starts_with("ITEM: UNITS")) {  // before the first timestep alone
        needed("the units");
        line = needed("ITEM: TIMESTEP");
      }
      double time = 0;
      if (line->starts_with("ITEM: TIME") && !line->starts_with("ITEM: TIMESTEP")) {
        time = cursor_.real_of(only_word("the time"), "the time");
        line = needed("ITEM: TIMESTEP");
      }
      if (!line->starts_with("ITEM: TIMESTEP"))
        fail(file_, cursor_.place(),
             "found " + in_quotes(*line) + ", wanted \"ITEM: TIMESTEP\" (a LAMMPS text dump)");
      const auto step = parse_integer(only_word("the timestep"));
      if (!step) fail(file_, cursor_.place(), "wanted the number of a timestep");
      steps.push_back(*step);
      const bool take = options_.timestep < 0 ? steps.size() == 1 : *step == options_.timestep;
      if (take && wanted)
        fail(file_, cursor_.place(), "timestep " + std::to_string(*step) + " appears twice");
      Particles found = read_step(take);
      if (!take) continue;
      wanted = std::move(found);
      wanted->time = time;
    }
    if (steps.empty()) fail(file_, "", "has no timestep");
    if (wanted && (options_.timestep >= 0 || steps.size() == 1)) return std::move(*wanted);
    std::string list;
    constexpr std::size_t kMost = 8;
    for (std::size_t k = 0; k < steps.size() && k <= kMost; ++k)
      list += (k > 0 ? ", " : "") + (k == kMost ? "..." : std::to_string(steps[k]));
    fail(file_, "",
         wanted ? "holds " + std::to_string(steps.size()) + " timesteps: " + list + " (give " +
                      setting("timestep") + " to say which)"
                : "has no timestep " + std::to_string(options_.timestep) + ", it has " + list);
  }

 private:
  std::optional<std::string_view> next() {
    for (;;) {
      const auto line = cursor_.next_line();
      if (!line || line->find_first_not_of(" \t") != std::string_view::npos) return line;
    }
  }
  std::string_view needed(const char* what) {
    const auto line = next();
    if (!line)
      fail(file_, cursor_.place(),
           std::string("the file ends here, wanted ").append(what).append(" (truncated?)"));
    return *line;
  }
  std::string_view only_word(const char* what) {
    Words words;
    split_at_blanks(needed(what), words);
    return words.empty() ? std::string_view() : words[0];
  }

  Particles read_step(bool take) {
    std::uint64_t count = 0;
    bool has_count = false;
    Box box;
    for (;;) {
      const std::string_view line = needed("ITEM: ATOMS");
      if (line.starts_with("ITEM: NUMBER OF ATOMS")) {
        const auto value = parse_integer(only_word("the number of atoms"));
        if (!value || *value < 0) fail(file_, cursor_.place(), "wanted the number of atoms");
        count = static_cast<std::uint64_t>(*value);
        has_count = true;
      } else if (line.starts_with("ITEM: BOX BOUNDS")) {
        read_box(box);
      } else if (line.starts_with("ITEM: ATOMS")) {
        if (!has_count) fail(file_, cursor_.place(), "no ITEM: NUMBER OF ATOMS comes before it");
        return read_atoms(line.substr(11), count, box, take);
      } else {
        fail(file_, cursor_.place(), "found " + in_quotes(line) + ", wanted an ITEM of a timestep");
      }
    }
  }

  void read_box(Box& box) {
    double tilt[3] = {0, 0, 0};
    Words words;
    for (std::size_t k = 0; k < 3; ++k) {
      split_at_blanks(needed("the bounds of the box"), words);
      if (words.size() < 2) fail(file_, cursor_.place(), "wanted two bounds of the box");
      box.low[k] = cursor_.real_of(words[0], "a bound");
      box.high[k] = cursor_.real_of(words[1], "a bound");
      if (words.size() > 2) tilt[k] = cursor_.real_of(words[2], "a tilt");
    }
    box.xy = tilt[0], box.xz = tilt[1], box.yz = tilt[2];
    // Of a tilted box the bounds are those of what it covers.
    box.low[0] -= std::min({0.0, box.xy, box.xz, box.xy + box.xz});
    box.high[0] -= std::max({0.0, box.xy, box.xz, box.xy + box.xz});
    box.low[1] -= std::min(0.0, box.yz);
    box.high[1] -= std::max(0.0, box.yz);
  }

  Axis axis(const std::vector<std::string>& names, char letter) {
    const std::string base(1, letter);
    for (const char* suffix : {"", "u", "s", "su"}) {
      const auto found = std::find(names.begin(), names.end(), base + suffix);
      if (found != names.end())
        return {static_cast<std::size_t>(found - names.begin()), suffix[0] == 's'};
    }
    fail(file_, cursor_.place(),
         "its atoms have no column " + base + ", " + base + "u, " + base + "s or " + base + "su");
  }

  std::array<Axis, 3> axes_of(const std::vector<std::string>& names) {
    const std::array<Axis, 3> axes{axis(names, 'x'), axis(names, 'y'), axis(names, 'z')};
    if (axes[0].scaled != axes[1].scaled || axes[0].scaled != axes[2].scaled)
      fail(file_, cursor_.place(), "some of x, y and z are scaled and others are not");
    return axes;
  }

  // A row of the table.
  void read_row(std::size_t columns, Words& words) {
    split_at_blanks(needed("an atom"), words);
    if (words.size() != columns)
      fail(file_, cursor_.place(),
           "found " + std::to_string(words.size()) + " columns, wanted " + std::to_string(columns) +
               " as in ITEM: ATOMS (truncated?)");
  }

  std::array<double, 3> position_in(const Words& words, const std::array<Axis, 3>& axes,
                                    const Box& box) {
    std::array<double, 3> p{};
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = cursor_.real_of(words[axes[k].column], "a coordinate");
    if (!axes[0].scaled) return p;
    return {box.low[0] + p[0] * (box.high[0] - box.low[0]) + p[1] * box.xy + p[2] * box.xz,
            box.low[1] + p[1] * (box.high[1] - box.low[1]) + p[2] * box.yz,
            box.low[2] + p[2] * (box.high[2] - box.low[2])};
  }

  Particles read_atoms(std::string_view header, std::uint64_t count, const Box& box, bool take) {
    Words words;
    split_at_blanks(header, words);
    const std::vector<std::string> names(words.begin(), words.end());
    if (names.empty()) fail(file_, cursor_.place(), "names no column of its atoms");
    if (count > cursor_.remaining() / (2 * names.size()))
      fail(file_, cursor_.place(),
           "the file ends at byte " + std::to_string(file_.size()) + ", wanted " +
               std::to_string(count) + " atoms of " + std::to_string(names.size()) +
               " columns (truncated?)");
    Particles particles;
    if (!take) {
      for (std::uint64_t i = 0; i < count; ++i) needed("an atom");
      return particles;
    }
    const std::array<Axis, 3> axes = axes_of(names);
    std::vector<Field> fields = fields_of_columns(names);
    for (Field& field : fields)
      if (field <= Field::z) field = Field::none;  // positions follow from the axes
    const auto picks = pick_attributes(file_.name, names, options_.attributes);
    resize(particles, fields, count);
    resize(particles, {Field::x, Field::y, Field::z}, count);
    for (const AttributePick& pick : picks)
      particles.attributes.push_back({pick.name, std::vector<float>(count)});
    const auto value = [&](std::size_t column) {
      return static_cast<float>(cursor_.real_of(words[column], names[column]));
    };
    for (std::size_t i = 0; i < count; ++i) {
      read_row(names.size(), words);
      if (i + 1 == count) cursor_.require_line_end();
      const std::array<double, 3> p = position_in(words, axes, box);
      particles.x[i] = static_cast<float>(p[0]);
      particles.y[i] = static_cast<float>(p[1]);
      particles.z[i] = static_cast<float>(p[2]);
      for (std::size_t k = 0; k < fields.size(); ++k)
        if (fields[k] == Field::id)
          particles.id[i] = cursor_.integer_of(words[k], "id");
        else if (fields[k] != Field::none)
          array_of(particles, fields[k])[i] = value(k);
      for (std::size_t k = 0; k < picks.size(); ++k)
        particles.attributes[k].values[i] = value(picks[k].array);
    }
    return particles;
  }

  const InputFile& file_;
  const ReadOptions& options_;
  TextCursor cursor_;
};

}  // namespace

Particles read_lammps(const InputFile& file, const ReadOptions& options) {
  return Reader(file, options).read();
}

}  // namespace meniscus
