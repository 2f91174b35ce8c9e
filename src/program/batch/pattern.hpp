// File names with a place for the frame's number.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace meniscus {

/// What a folder stands for as an input: the one sequence in it, as a pattern with {} for the last
/// number in the names, or the last that makes one sequence of them, or the only file. Files whose
/// ending no reader knows are left out, meshes that this program wrote, and .ffp3 files that hold
/// no positions. Any other path is returned as it is. Throws InputError where there is none, or
/// several, or the folder cannot be listed.
std::string sequence_in_folder(const std::string& path);

/// A name such as dam.####.ply, dam.%04d.ply, dam.$F4.ply or dam.{}.ply. A place has a width, to
/// which numbers are padded with zeros (%d, $F: none); {} takes numbers however they are padded,
/// and {:04d} is %04d. A name may have several places, in folders, too: all hold the same number.
class FramePattern {
 public:
  /// Nothing when `path` has no place for a number, or when there is a file of just that name; but
  /// a .pvd is a sequence, whose frames are its time steps, numbered from 0. Throws InputError for
  /// a .pvd that cannot be read, or of which a time step has several parts.
  static std::optional<FramePattern> in(const std::string& path);

  /// Whether the file's own name has a place, whether there is such a file or not. A single # is
  /// taken for a letter.
  static bool is_in_name(const std::string& path);

  const std::string& text() const { return text_; }

  /// The name for a frame. {} becomes `digits`, or the bare number where that is empty.
  std::string name(std::int64_t frame, const std::string& digits = "") const {
    return spell(pieces_, frame, digits);
  }

  struct Found {
    std::string path;
    std::string digits;  // of the number in the file's name; empty of a .pvd
  };

  /// The files there are, by frame. A * in the pattern stands for any characters of a file's or
  /// folder's name and stays in the path. Throws InputError when {} finds two files of one frame
  /// (7 and 007), or where a folder cannot be listed.
  std::map<std::int64_t, Found> existing() const;

  /// Files whose numbers have a minus before them. They are no frames: these count from 0.
  std::vector<std::string> below_zero() const;

  /// In words that nothing was found, and what is there instead.
  std::string absence() const;

 private:
  struct Piece {
    std::string literal;  // before the place
    int width = 0;        // of the place: 0 as many digits as it takes, -1 any padding
    bool place = false;   // whether a place follows
  };
  struct Match;
  struct NameFit;
  int last_width() const;  // of the last place
  static std::string spell(const std::vector<Piece>& pieces, std::int64_t frame,
                           const std::string& digits);
  void walk(const std::vector<std::vector<Piece>>& folders, std::size_t depth,
            const std::string& folder, const Match& match,
            std::map<std::int64_t, Found>& found) const;

  std::string text_;
  std::vector<Piece> pieces_;
  std::map<std::int64_t, Found> listed_;  // of a .pvd
};

}  // namespace meniscus
