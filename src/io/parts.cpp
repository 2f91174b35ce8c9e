#include "io/parts.hpp"

#include <glob.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

#include "io/input_file.hpp"
#include "io/rows.hpp"

namespace meniscus {
namespace {

class JoinedSource : public ParticleSource {
 public:
  JoinedSource(const std::vector<std::string>& paths, const ReadOptions& options, Team& team)
      : team_(team), ranks_(team.size()) {
    parts_.resize(paths.size());
    std::vector<PartHeader> mine;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      parts_[k].path = paths[k];
      if (owner(k) != team.rank()) continue;
      const auto& source = parts_[k].source = open_file(paths[k], options);
      mine.push_back({k, source->size(), source->particle_radius(), source->has_radius(),
                      source->has_velocity(), source->in_memory() == nullptr});
    }
    std::vector<PartHeader> headers(paths.size());
    for (const PartHeader& one : team.joined(std::move(mine))) headers[one.part] = one;
    settle(headers);
    settle_attributes();
    for (std::size_t k = 0; k < paths.size(); ++k) {
      Part& part = parts_[k];
      if (headers[k].on_disk && static_cast<int>(paths.size()) < ranks_) {
        if (!part.source) open_range(k, options);
        const auto place = [&](int rank) { return part.first + part.size * rank / ranks_; };
        share_.push_back({place(team.rank()), place(team.rank() + 1) - place(team.rank())});
      } else if (part.source) {
        share_.push_back({part.first, part.size});
      }
    }
  }

  std::int64_t size() const override { return size_; }
  bool has_radius() const override { return has_radius_; }
  bool has_velocity() const override { return has_velocity_; }
  double particle_radius() const override { return particle_radius_; }
  std::vector<std::string> attributes() const override { return attributes_; }
  Team& team() const override { return team_; }
  std::vector<ParticleRange> share() const override { return share_; }

  std::string name(std::int64_t particle) const override {
    const Part& part = part_of(particle);
    if (parts_.size() == 1 && part.source) return part.source->name(particle);
    return "particle " + std::to_string(particle - part.first) + " of " + part.path;
  }

  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    for (std::size_t done = 0; done < count;) {
      const Part& part = part_of(first + static_cast<std::int64_t>(done));
      const std::int64_t from = first + static_cast<std::int64_t>(done) - part.first;
      const std::size_t now = std::min(count - done, static_cast<std::size_t>(part.size - from));
      require(part.source != nullptr, part.path + ": is not of this process's share");
      part.source->read(from, now, to.from(done));
      done += now;
    }
  }

 private:
  struct Part {
    std::string path;
    std::unique_ptr<ParticleSource> source;  // where this process reads of it
    std::int64_t first = 0, size = 0;        // in the frame
  };

  // What all processes learn of a part from the one that opened it.
  struct PartHeader {
    std::size_t part = 0;
    std::int64_t size = 0;
    double particle_radius = 0;
    bool has_radius = false, has_velocity = false, on_disk = false;
  };

  int owner(std::size_t part) const {
    return static_cast<int>(part % static_cast<std::size_t>(ranks_));
  }

  // Where the parts lie in the frame, and what it has as a whole. Parts without particles say
  // nothing about the others.
  void settle(const std::vector<PartHeader>& headers) {
    const Part* stated = nullptr;  // the first that has particles
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      Part& part = parts_[k];
      part.first = size_;
      part.size = headers[k].size;
      size_ += part.size;
      if (part.size == 0) continue;
      if (!stated) {
        stated = &part;
        has_radius_ = headers[k].has_radius;
        has_velocity_ = headers[k].has_velocity;
        particle_radius_ = headers[k].particle_radius;
      }
      require_agreement(part, headers[k], *stated);
    }
  }

  // The names that the first part with particles has, whose process tells the others.
  void settle_attributes() {
    std::vector<char> mine;  // for each part: its names, each after a line feed, then a zero
    std::vector<std::size_t> places;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      if (!parts_[k].source) continue;
      places.push_back(k);
      std::string names;
      for (const std::string& name : parts_[k].source->attributes()) names += '\n' + name;
      mine.insert(mine.end(), names.begin(), names.end());
      mine.push_back('\0');
    }
    const std::vector<std::size_t> order = team_.joined(std::move(places));
    const std::vector<char> all = team_.joined(std::move(mine));
    std::vector<std::string> names(parts_.size());
    std::size_t at = 0;
    for (const std::size_t k : order) {
      names[k] = all.data() + at;
      at += names[k].size() + 1;
    }
    const std::string* stated = nullptr;
    std::size_t first = 0;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      if (parts_[k].size == 0) continue;
      if (!stated) {
        stated = &names[k];
        first = k;
      }
      if (names[k] != *stated)
        throw InputError(parts_[k].path + ": its attributes have other components than those of " +
                         parts_[first].path + " (the parts of a frame must agree)");
    }
    if (!stated) stated = &names[0];
    for (std::size_t begin = 0; begin < stated->size();) {
      const std::size_t end = std::min(stated->find('\n', begin + 1), stated->size());
      attributes_.push_back(stated->substr(begin + 1, end - begin - 1));
      begin = end;
    }
  }

  void require_agreement(const Part& part, const PartHeader& header, const Part& stated) const {
    const std::string must = " (the parts of a frame must agree",
                      override = "; give " + setting("particle-radius") + " to override";
    const auto require_same = [&](const std::string& values, bool here, bool there,
                                  const std::string& advice) {
      if (here != there)
        throw InputError(part.path + ": its particles have " + (here ? "" : "no ") + values +
                         ", those of " + stated.path + " have " + (there ? "some" : "none") + must +
                         advice + ")");
    };
    require_same("radii", header.has_radius, has_radius_, override);
    require_same("velocities", header.has_velocity, has_velocity_, "");
    if (header.particle_radius != particle_radius_)
      throw InputError(part.path + ": particle_radius is " + shown(header.particle_radius) +
                       ", in " + stated.path + " it is " + shown(particle_radius_) + must +
                       override + ")");
  }

  void open_range(std::size_t k, const ReadOptions& options) {
    Part& part = parts_[k];
    part.source = open_rows(part.path, options);
    if (!part.source || part.source->size() != part.size)
      throw InputError(part.path + ": is not the file of " + std::to_string(part.size) +
                       " particles that rank " + std::to_string(owner(k)) +
                       " found (all ranks must see the same files)");
  }

  const Part& part_of(std::int64_t particle) const {
    const auto after =
        std::upper_bound(parts_.begin(), parts_.end(), particle,
                         [](std::int64_t p, const Part& part) { return p < part.first; });
    return *(after - 1);  // the last that begins there: those before it are empty
  }

  Team& team_;
  int ranks_;
  std::vector<std::string> attributes_;  // their names
  std::vector<Part> parts_;
  std::vector<ParticleRange> share_;
  std::int64_t size_ = 0;
  bool has_radius_ = false, has_velocity_ = false;
  double particle_radius_ = 0;
};

}  // namespace

bool naturally_before(const std::string& a, const std::string& b) {
  for (std::size_t i = 0, k = 0;;) {
    if (i == a.size() || k == b.size()) {
      if (i == a.size() && k == b.size()) return a < b;  // 7 and 007
      return i == a.size();
    }
    if (is_digit(a[i]) && is_digit(b[k])) {
      const auto number = [](const std::string& text, std::size_t& at) {
        while (at < text.size() && text[at] == '0') ++at;
        const std::size_t begin = at;
        while (at < text.size() && is_digit(text[at])) ++at;
        return text.substr(begin, at - begin);
      };
      const std::string one = number(a, i), other = number(b, k);
      if (one.size() != other.size()) return one.size() < other.size();
      if (one != other) return one < other;
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
    }
  }
}

std::vector<std::string> part_files(const std::string& path) {
  std::error_code error;
  if (path.find('*') == std::string::npos || std::filesystem::exists(path, error)) return {path};
  std::string pattern;
  for (const char c : path) {
    if (std::strchr("?[]\\", c)) pattern += '\\';
    pattern += c;
  }
  // Of a folder that cannot be listed, particles would be missing.
  thread_local std::string unlisted;
  unlisted.clear();
  glob_t found{};
  const auto tell = [](const char* folder, int why) {
    if (why == ENOENT) return 0;
    unlisted = std::string(folder) + ": cannot be listed: " + std::generic_category().message(why);
    return 1;
  };
  if (glob(pattern.c_str(), GLOB_NOSORT, tell, &found) == GLOB_NOSPACE) throw std::bad_alloc();
  std::vector<std::string> files(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  globfree(&found);
  if (!unlisted.empty()) throw InputError(unlisted);
  std::erase_if(files, [&](const std::string& name) {
    return !std::filesystem::is_regular_file(name, error);
  });
  if (files.empty()) throw InputError(path + ": no file matches");
  std::sort(files.begin(), files.end(), naturally_before);
  return files;
}

std::unique_ptr<ParticleSource> open_parts(const std::string& path, const ReadOptions& options,
                                           Team& team) {
  std::string names;  // each ends with a zero
  if (team.leads())
    for (const std::string& name : part_files(path)) names += name + '\0';
  names = team.from_first(names);
  std::vector<std::string> paths;
  for (std::size_t at = 0; at < names.size(); at = names.find('\0', at) + 1)
    paths.emplace_back(names.c_str() + at);
  if (paths.size() == 1 && team.size() == 1) return open_file(paths[0], options);
  return std::make_unique<JoinedSource>(paths, options, team);
}

}  // namespace meniscus
