#include "program/batch/pattern.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "io/input_file.hpp"
#include "io/parts.hpp"
#include "io/readers.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFrameDigits = 18;  // of kLastFrame

// A place at the start of `text`: how many characters it takes, 0: there is none.
std::size_t place_at(const std::string& text, std::size_t at, int& width) {
  const auto digits_from = [&](std::size_t from) {
    std::size_t end = from;
    while (end < text.size() && is_digit(text[end]) && end - from < 3) ++end;
    return end;
  };
  const auto number = [&](std::size_t from, std::size_t end) {
    int value = 0;
    std::from_chars(text.data() + from, text.data() + end, value);
    return value;
  };
  switch (text[at]) {
    case '#': {
      std::size_t end = at;
      while (end < text.size() && text[end] == '#') ++end;
      width = static_cast<int>(end - at);
      return end - at;
    }
    case '%': {  // %d, %04d; not %4d, which pads with spaces
      const std::size_t end = digits_from(at + 1);
      if (end == text.size() || text[end] != 'd' || (end > at + 1 && text[at + 1] != '0')) return 0;
      width = number(at + 1, end);
      return end + 1 - at;
    }
    case '$': {
      if (at + 1 == text.size() || text[at + 1] != 'F') return 0;
      const std::size_t end = digits_from(at + 2);
      width = number(at + 2, end);
      return end - at;
    }
    case '{': {
      if (at + 1 < text.size() && text[at + 1] == '}') {
        width = -1;
        return 2;
      }
      if (at + 2 >= text.size() || text[at + 1] != ':' || text[at + 2] != '0') return 0;
      std::size_t end = digits_from(at + 2);
      width = number(at + 2, end);
      if (end < text.size() && text[end] == 'd') ++end;
      return end < text.size() && text[end] == '}' ? end + 1 - at : 0;
    }
    default:
      return 0;
  }
}

std::string padded(std::int64_t frame, int width) {
  const std::string digits = std::to_string(frame);
  const std::size_t wanted = static_cast<std::size_t>(std::max(0, width));
  return std::string(wanted > digits.size() ? wanted - digits.size() : 0, '0') + digits;
}

// Calls visit(entry) for each entry of a folder; for none where there is no such folder. One that
// cannot be listed to its end would lose frames.
template <class Visit>
void for_each_entry(const fs::path& folder, const Visit& visit) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    visit(*entry);
  if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
    throw InputError(folder.string() + ": cannot be listed: " + error.message());
}

}  // namespace

// What the places matched so far hold.
struct FramePattern::Match {
  std::int64_t frame = -1;
  std::string digits;  // of a {}
  std::string path;    // so far, * as it is
};

bool FramePattern::is_in_name(const std::string& path) {
  const std::string name = fs::path(path).filename().string();
  int width = 0;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t length = place_at(name, at, width);
    if (length > (name[at] == '#' ? 1 : 0)) return true;
    at += std::max<std::size_t>(length, 1);
  }
  return false;
}

namespace {

// Whether a file is a mesh that this program wrote: it bears a seal.
bool is_output(const fs::path& path) {
  constexpr std::size_t kHead = 4096;  // bytes
  std::string head(kHead, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(kHead));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head.find("meniscus.hash") != std::string::npos;
}

// Where a number in the stem of a file's name is: the last one, or so many `back`.
struct NumberPlace {
  std::size_t first, end;
};
std::optional<NumberPlace> number_in(const std::string& name, std::size_t back) {
  std::size_t end = name.size() - particle_ending(name).size();
  for (;; --back) {
    while (end > 0 && !is_digit(name[end - 1])) --end;
    if (end == 0) return {};
    std::size_t first = end;
    while (first > 0 && is_digit(name[first - 1])) --first;
    if (back == 0) return NumberPlace{first, end};
    end = first;
  }
}

// The name with a place for that number; empty where it has none.
std::string pattern_of(const std::string& name, std::size_t back) {
  const auto number = number_in(name, back);
  return number ? name.substr(0, number->first) + "{}" + name.substr(number->end) : "";
}

}  // namespace

std::string sequence_in_folder(const std::string& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return path;
  std::map<std::string, std::vector<std::string>> sequences;  // names, by the pattern they follow
  std::set<std::string> plain;                                // names without a number
  for_each_entry(path, [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_regular_file(ignored) || name.starts_with(".") || !is_particle_file(name)) return;
    // FLIP Fluids keeps velocities and others beside the positions.
    if (const auto number = number_in(name, 0);
        number && lower_case(particle_ending(name)) == ".ffp3" &&
        lower_case(name.substr(0, number->first)) != "fluidparticles")
      return;
    const std::string pattern = pattern_of(name, 0);
    const auto known = sequences.find(pattern);
    if (known != sequences.end())
      known->second.push_back(name);
    else if (is_output(entry.path()))
      return;
    else if (pattern.empty())
      plain.insert(name);
    else
      sequences[pattern].push_back(name);
  });
  const auto in_folder = [&](const std::string& name) { return (fs::path(path) / name).string(); };
  if (sequences.empty() && plain.empty())
    throw InputError(path + ": is a folder without files of particles, wanted one sequence");
  if (sequences.empty() && plain.size() == 1) return in_folder(*plain.begin());
  if (sequences.size() == 1) return in_folder(sequences.begin()->first);
  // A number behind the frame's may be the same in all: of a version, as in dam.0001.v2.ply.
  if (!sequences.empty())
    for (std::size_t back = 1; number_in(sequences.begin()->second[0], back); ++back) {
      std::set<std::string> patterns;
      for (const auto& [pattern, names] : sequences)
        for (const std::string& name : names) patterns.insert(pattern_of(name, back));
      if (patterns.size() == 1) return in_folder(*patterns.begin());
    }
  constexpr std::size_t kListed = 10;
  std::set<std::string> all = plain;
  for (const auto& [pattern, names] : sequences) all.insert(pattern);
  std::string list;
  std::size_t listed = 0;
  for (const std::string& one : all)
    if (listed++ < kListed) list += (list.empty() ? "" : ", ") + in_folder(one);
  if (listed > kListed) list += " and " + std::to_string(listed - kListed) + " more";
  throw InputError(path + ": is a folder with several sequences, say which: " + list);
}

std::optional<FramePattern> FramePattern::in(const std::string& path) {
  std::error_code ignored;
  FramePattern pattern;
  pattern.text_ = path;
  if (fs::is_regular_file(path, ignored) && lower_case(path).ends_with(".pvd")) {
    std::vector<SeriesFrame> frames = read_pvd(read_file(path));
    std::stable_sort(frames.begin(), frames.end(),
                     [](const SeriesFrame& a, const SeriesFrame& b) { return a.time < b.time; });
    for (std::size_t k = 0; k < frames.size(); ++k) {
      if (k > 0 && frames[k].time == frames[k - 1].time)
        throw InputError(path + ": " + frames[k - 1].file + " and " + frames[k].file +
                         " are both of time " + shown(frames[k].time) +
                         ": give the parts of one frame with a *, e.g. name_*.vtp");
      const fs::path file(frames[k].file);
      pattern.listed_[static_cast<std::int64_t>(k)] = {
          file.is_absolute() ? file.string() : (fs::path(path).parent_path() / file).string(), ""};
    }
    return pattern;
  }
  if (fs::exists(path, ignored)) return std::nullopt;
  Piece piece;
  for (std::size_t at = 0; at < path.size();) {
    const std::size_t length = place_at(path, at, piece.width);
    if (length == 0) {
      piece.literal += path[at++];
      continue;
    }
    piece.place = true;
    pattern.pieces_.push_back(piece);
    piece = {};
    at += length;
  }
  if (pattern.pieces_.empty()) return std::nullopt;
  pattern.pieces_.push_back(piece);
  return pattern;
}

std::string FramePattern::spell(const std::vector<Piece>& pieces, std::int64_t frame,
                                const std::string& digits) {
  std::string name;
  for (const Piece& piece : pieces) {
    name += piece.literal;
    if (piece.place)
      name += piece.width < 0 && !digits.empty() ? digits : padded(frame, piece.width);
  }
  return name;
}

int FramePattern::last_width() const {
  int width = 0;
  for (const Piece& piece : pieces_)
    if (piece.place) width = piece.width;
  return width;
}

// How an entry's name fits the pieces: piece by piece, character by character.
struct FramePattern::NameFit {
  const std::vector<Piece>& pieces;
  const std::string& name;

  // From a * there are many ways; those that lead nowhere are not gone again.
  using Way = std::tuple<std::size_t, std::size_t, std::size_t, std::int64_t, std::string>;
  std::set<Way> dead;

  // What the places hold where the name from character `at` on fits the pieces from character
  // `within` of a literal on.
  std::optional<Match> from(std::size_t piece, std::size_t within, std::size_t at,
                            const Match& match) {
    const std::string& text = pieces[piece].literal;
    if (within < text.size()) {
      if (text[within] == '*') return from_star(piece, within, at, match);
      if (at == name.size() || name[at] != text[within]) return {};
      return from(piece, within + 1, at + 1, match);
    }
    if (pieces[piece].place) return from_place(piece, at, match);
    return at == name.size() ? std::optional(match) : std::nullopt;
  }

  std::optional<Match> from_star(std::size_t piece, std::size_t within, std::size_t at,
                                 const Match& match) {
    Way way{piece, within, at, match.frame, match.digits};
    if (dead.contains(way)) return {};
    for (std::size_t end = at; end <= name.size(); ++end)
      if (auto whole = from(piece, within + 1, end, match)) return whole;
    dead.insert(std::move(way));
    return {};
  }

  std::optional<Match> from_place(std::size_t piece, std::size_t at, const Match& match) {
    std::size_t end = at;
    while (end < name.size() && is_digit(name[end]) && end - at < kFrameDigits) ++end;
    for (; end > at; --end) {  // digits may be followed by literal digits
      const std::string digits = name.substr(at, end - at);
      Match now = match;
      std::from_chars(digits.data(), digits.data() + digits.size(), now.frame);
      if (match.frame >= 0 && match.frame != now.frame) continue;
      if (pieces[piece].width < 0) {
        if (!match.digits.empty() && match.digits != digits) continue;
        now.digits = digits;
      } else if (digits != padded(now.frame, pieces[piece].width)) {
        continue;
      }
      if (auto whole = from(piece + 1, 0, end, now)) return whole;
    }
    return {};
  }
};

void FramePattern::walk(const std::vector<std::vector<Piece>>& folders, std::size_t depth,
                        const std::string& folder, const Match& before,
                        std::map<std::int64_t, Found>& found) const {
  const std::vector<Piece>& pieces = folders[depth];
  const bool last = depth + 1 == folders.size();
  const auto matched = [&](const std::string& entry, const Match& match) {
    const std::string path = folder + entry;
    if (!last) return walk(folders, depth + 1, path + "/", match, found);
    const Found file{match.path,
                     match.digits.empty() ? padded(match.frame, last_width()) : match.digits};
    const auto [place, is_new] = found.try_emplace(match.frame, file);
    if (!is_new && place->second.path != file.path)
      throw InputError(place->second.path + " and " + file.path + " are both frame " +
                       std::to_string(match.frame) + " of " + text_ +
                       ": rename one, or say how wide the number is, e.g. ####");
  };
  const bool literal = pieces.size() == 1 && pieces[0].literal.find('*') == std::string::npos;
  if (literal) {
    const std::string& name = pieces[0].literal;
    std::error_code ignored;
    if (last ? fs::exists(folder + name, ignored) : true) {
      Match match = before;
      match.path += name + (last ? "" : "/");
      matched(name, match);
    }
    return;
  }
  for_each_entry(folder.empty() ? "." : folder, [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    if (auto match = NameFit{pieces, name, {}}.from(0, 0, 0, before)) {
      match->path += spell(pieces, match->frame, match->digits) + (last ? "" : "/");
      matched(name, *match);
    }
  });
}

std::map<std::int64_t, FramePattern::Found> FramePattern::existing() const {
  if (!listed_.empty()) return listed_;
  std::vector<std::vector<Piece>> folders(1);
  for (const Piece& piece : pieces_) {
    std::size_t begin = 0;
    for (std::size_t slash; (slash = piece.literal.find('/', begin)) != std::string::npos;
         begin = slash + 1) {
      folders.back().push_back({piece.literal.substr(begin, slash - begin), 0, false});
      folders.emplace_back();
    }
    folders.back().push_back({piece.literal.substr(begin), piece.width, piece.place});
  }
  // A place at the end of a folder's or file's name is followed by nothing.
  for (std::vector<Piece>& pieces : folders)
    if (pieces.back().place) pieces.push_back({});
  std::map<std::int64_t, Found> found;
  walk(folders, 0, "", {}, found);
  return found;
}

std::vector<std::string> FramePattern::below_zero() const {
  std::vector<std::string> paths;
  FramePattern below = *this;
  for (Piece& piece : below.pieces_) {
    if (piece.place) piece.literal += '-';
    piece.width = -1;
  }
  if (listed_.empty()) try {
      for (const auto& [frame, file] : below.existing()) paths.push_back(file.path);
    } catch (const InputError&) {  // two of one number, none of which is asked for
    }
  return paths;
}

std::string FramePattern::absence() const {
  if (pieces_.empty()) return text_ + ": lists no file";
  const std::string& start = pieces_.front().literal;
  const std::string folder = start.substr(0, start.rfind('/') + 1);
  std::error_code ignored;
  if (!folder.empty() && folder.find('*') == std::string::npos &&
      !fs::is_directory(folder, ignored))
    return text_ + ": there is no folder " + folder;
  std::string line = text_ + ": no file matches";
  FramePattern loose = *this;
  for (Piece& piece : loose.pieces_) piece.width = -1;
  try {
    const auto found = loose.existing();
    if (!found.empty())
      line += "; the nearest is " + found.begin()->second.path +
              " (write {} for numbers however they are padded, or as many # as they have digits)";
    else if (is_particle_file(text_))
      line += "; the folder has " + sequence_in_folder(folder.empty() ? "." : folder);
  } catch (const InputError&) {  // none or several are there, none of which was asked for
  }
  return line;
}

}  // namespace meniscus
