// Files of foam, spray and bubbles that go with a frame.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "meniscus/whitewater.hpp"

namespace meniscus {

/// Where the particles of one type are.
struct WhitewaterInput {
  WhitewaterType type = WhitewaterType::foam;
  std::string path;  // of a sequence with a place for the frame's number; empty: there are none
  std::string attribute;  // whose value tells them from others; empty: all particles are
  double value = 0;
};

/// "foam=FILE", or "foam=FILE@ATTRIBUTE=NUMBER" for those of its particles whose attribute has this
/// value. Throws InvalidArgument.
WhitewaterInput parse_whitewater(const std::string& text);

/// The same of all, each of another type. Throws InvalidArgument.
std::vector<WhitewaterInput> parse_whitewater(const std::vector<std::string>& texts);

/// Opened files.
class Whitewater {
 public:
  Whitewater() = default;
  /// Opens them. Throws InputError.
  ///
  ///   radius  as of WhitewaterParams
  Whitewater(const std::vector<WhitewaterInput>& inputs, double radius);

  bool empty() const { return sources_.empty(); }
  const std::vector<WhitewaterSource>& sources() const { return sources_; }

 private:
  std::vector<std::unique_ptr<ParticleSource>> particles_;
  std::vector<WhitewaterSource> sources_;
};

}  // namespace meniscus
