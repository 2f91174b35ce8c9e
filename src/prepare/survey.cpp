#include "prepare/survey.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <future>

#include "base/parallel.hpp"
#include "base/position_hash.hpp"
#include "base/printed.hpp"
#include "base/rounded_up.hpp"
#include "base/team.hpp"
#include "meniscus/error.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kPart = std::size_t{1} << 15;  // particles that are worth a thread
constexpr std::size_t kRun = 1024;                   // particles that are looked at together
constexpr std::size_t kFew = 64;                     // of which hardly one is of a large sample
constexpr std::int64_t kNoParticle = std::numeric_limits<std::int64_t>::max();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Adds the particles whose hash is at most `most`. Whether there is one is asked of all at once.
void add_sample(const ParticleChunk& chunk, std::size_t begin, std::size_t end, std::uint32_t most,
                std::vector<std::array<float, 3>>& sample) {
  const float *const x = chunk.x.data(), *const y = chunk.y.data(), *const z = chunk.z.data();
  std::uint32_t any = 0;
  for (std::size_t i = begin; i < end; ++i) any |= position_hash(x[i], y[i], z[i]) <= most;
  if (!any) return;
  for (std::size_t i = begin; i < end; ++i)
    if (position_hash(x[i], y[i], z[i]) <= most) sample.push_back({x[i], y[i], z[i]});
}

// Whole numbers that order as floats do.
std::int32_t ordered(float value) {
  const std::int32_t bits = std::bit_cast<std::int32_t>(value);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
float from_ordered(std::int32_t key) {
  return std::bit_cast<float>(key ^ ((key >> 31) & 0x7fffffff));
}

bool finite(float x, float y, float z) {
  return std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
}

// The middle of many positive floats, exactly, without keeping them: their bits order like whole
// numbers, so that the first pass finds its upper half and the second its lower.
class Middle {
 public:
  void add(float value) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
    if (upper_ < 0)
      ++count_[bits >> 16];
    else if (static_cast<std::int64_t>(bits >> 16) == upper_)
      ++count_[bits & 0xffff];
  }
  /// Ends the first pass, over `total` values of all ranks.
  void narrow(Team& team, std::int64_t total) {
    team.sum(count_);
    rank_ = total / 2;
    upper_ = static_cast<std::int64_t>(place());
    count_.assign(count_.size(), 0);
  }
  float value(Team& team) {
    team.sum(count_);
    return std::bit_cast<float>(
        static_cast<std::uint32_t>(upper_ << 16 | static_cast<std::int64_t>(place())));
  }

 private:
  // Where the value of rank_ lies; rank_ becomes its rank there.
  std::size_t place() {
    std::size_t k = 0;
    while (k + 1 < count_.size() && rank_ >= count_[k]) rank_ -= count_[k++];
    return k;
  }
  std::vector<std::int64_t> count_ = std::vector<std::int64_t>(1 << 16);
  std::int64_t upper_ = -1, rank_ = 0;
};

// What was found among some of the particles.
struct Found {
  std::int64_t finite = 0, first_bad = kNoParticle, first_bad_radius = kNoParticle;
  float bad_radius = 0, least_radius = kInfinity, largest_radius = 0;
  std::array<float, 3> low{kInfinity, kInfinity, kInfinity};
  std::array<float, 3> high{-kInfinity, -kInfinity, -kInfinity};
};

Found merged(const std::vector<Found>& parts) {
  Found all;
  for (const Found& one : parts) {
    all.finite += one.finite;
    all.first_bad = std::min(all.first_bad, one.first_bad);
    if (one.first_bad_radius < all.first_bad_radius) {
      all.first_bad_radius = one.first_bad_radius;
      all.bad_radius = one.bad_radius;
    }
    all.least_radius = std::min(all.least_radius, one.least_radius);
    all.largest_radius = std::max(all.largest_radius, one.largest_radius);
    for (std::size_t a = 0; a < 3; ++a) {
      all.low[a] = std::min(all.low[a], one.low[a]);
      all.high[a] = std::max(all.high[a], one.high[a]);
    }
  }
  return all;
}

// What is found in a part of a chunk, and the particles of it that are of the sample.
struct RunsFound {
  Found found;
  std::vector<std::array<float, 3>> sample;
};

void widen(Found& found, std::size_t axis, float low, float high) {
  found.low[axis] = std::min(found.low[axis], low);
  found.high[axis] = std::max(found.high[axis], high);
}

// The bounds of a run whose coordinates are all finite; else nothing is found and it says so.
// Straight loops over whole numbers, which the compiler turns into vectors.
bool find_bounds(const ParticleChunk& chunk, std::size_t begin, std::size_t end, Found& found) {
  const std::vector<float>* const axes[3] = {&chunk.x, &chunk.y, &chunk.z};
  bool good = true;
  std::array<std::int32_t, 3> least{}, largest{};
  for (std::size_t a = 0; a < 3; ++a) {
    const float* const values = axes[a]->data();
    std::int32_t bad = 0, lower = INT32_MAX, upper = INT32_MIN;
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t key = ordered(values[i]);
      bad |= (std::bit_cast<std::int32_t>(values[i]) & 0x7f800000) == 0x7f800000;
      lower = key < lower ? key : lower;
      upper = key > upper ? key : upper;
    }
    good = good && bad == 0;
    least[a] = lower;
    largest[a] = upper;
  }
  if (good)
    for (std::size_t a = 0; a < 3; ++a)
      widen(found, a, from_ordered(least[a]), from_ordered(largest[a]));
  return good;
}

// A particle with a radius of its own, or in a run with one that is not finite.
void look_at_one(const ParticleChunk& chunk, std::size_t i, bool bounded, std::uint32_t most,
                 RunsFound& part) {
  Found& found = part.found;
  const float at[3] = {chunk.x[i], chunk.y[i], chunk.z[i]};
  const std::int64_t particle = chunk.first + static_cast<std::int64_t>(i);
  const float* const radius = chunk.radius.empty() ? nullptr : &chunk.radius[i];
  if (radius && (!(*radius > 0) || !std::isfinite(*radius)) &&
      found.first_bad_radius == kNoParticle) {
    found.first_bad_radius = particle;
    found.bad_radius = *radius;
  }
  if (!bounded && !finite(at[0], at[1], at[2])) {
    found.first_bad = std::min(found.first_bad, particle);
    return;
  }
  if (!bounded)
    for (std::size_t a = 0; a < 3; ++a) widen(found, a, at[a], at[a]);
  ++found.finite;
  if (radius) {
    found.least_radius = std::min(found.least_radius, *radius);
    found.largest_radius = std::max(found.largest_radius, *radius);
  }
  if (position_hash(at[0], at[1], at[2]) <= most) part.sample.push_back({at[0], at[1], at[2]});
}

RunsFound look_at(const ParticleChunk& chunk, std::size_t first, std::size_t last,
                  std::uint32_t most) {
  RunsFound part;
  for (std::size_t begin = first; begin < last; begin += kRun) {
    const std::size_t end = std::min(begin + kRun, last);
    const bool bounded = find_bounds(chunk, begin, end, part.found);
    if (!bounded || !chunk.radius.empty()) {
      for (std::size_t i = begin; i < end; ++i) look_at_one(chunk, i, bounded, most, part);
      continue;
    }
    part.found.finite += static_cast<std::int64_t>(end - begin);
    for (std::size_t from = begin; from < end; from += kFew)
      add_sample(chunk, from, std::min(from + kFew, end), most, part.sample);
  }
  return part;
}

}  // namespace

std::size_t chunk_within(std::size_t memory, std::size_t bytes_per_particle) {
  constexpr std::size_t kGroup = 64;  // work-items
  return std::clamp(memory / bytes_per_particle / kGroup * kGroup, kGroup, kMostChunk);
}

void for_each_chunk(const ParticleSource& source, std::size_t size, const ChunkValues& also,
                    const std::function<void(ParticleChunk&)>& work) {
  const bool radius = also.radius && source.has_radius();
  const bool velocity = also.velocity && source.has_velocity();
  const std::size_t attributes = also.attributes ? source.attributes().size() : 0;
  const auto read = [&](ParticleChunk& chunk, const ParticleRange& range) {
    chunk.first = range.first;
    chunk.count = static_cast<std::size_t>(range.count);
    const std::size_t stride = rounded_up(chunk.count, 64);
    for (std::vector<float>* values : {&chunk.x, &chunk.y, &chunk.z}) {
      values->resize(stride);
      std::fill(values->begin() + static_cast<std::ptrdiff_t>(chunk.count), values->end(), 0.0f);
    }
    ParticleArrays to{.x = chunk.x.data(), .y = chunk.y.data(), .z = chunk.z.data()};
    const auto add = [&](std::vector<float>& values, float*& array) {
      values.resize(stride);
      array = values.data();
    };
    if (velocity) add(chunk.vx, to.vx), add(chunk.vy, to.vy), add(chunk.vz, to.vz);
    if (radius) add(chunk.radius, to.radius);
    chunk.attributes.resize(attributes);
    for (std::vector<float>& values : chunk.attributes) add(values, to.attributes.emplace_back());
    source.read(chunk.first, chunk.count, to);
  };
  const std::vector<ParticleRange> share = source.share();
  std::size_t place = 0;  // in the share
  std::int64_t done = 0;  // of the range there
  const auto following = [&]() -> ParticleRange {
    while (place < share.size() && done == share[place].count) {
      ++place;
      done = 0;
    }
    if (place == share.size()) return {};
    const std::int64_t first = share[place].first + done;
    const std::int64_t count = std::min(static_cast<std::int64_t>(size), share[place].count - done);
    done += count;
    return {first, count};
  };
  ParticleRange range = following();
  if (range.count == 0) return;
  const unsigned threads = threads_here();
  ParticleChunk now, next;
  read(now, range);
  for (;;) {
    range = following();
    std::future<void> ahead;  // its destructor waits
    if (range.count > 0)
      ahead =
          std::async(std::launch::async, [&] { on_threads(threads, [&] { read(next, range); }); });
    work(now);
    if (!ahead.valid()) return;
    ahead.get();
    std::swap(now, next);
  }
}

const Survey& survey_of(const ParticleSource& source) {
  if (!source.survey_) source.survey_ = std::make_shared<const Survey>(survey_particles(source));
  return *source.survey_;
}

Particles positions_where(const ParticleSource& source,
                          const std::function<bool(float x, float y, float z)>& wanted) {
  Particles found;
  for_each_chunk(source, kMostChunk, {}, [&](const ParticleChunk& chunk) {
    for (std::size_t i = 0; i < chunk.count; ++i)
      if (wanted(chunk.x[i], chunk.y[i], chunk.z[i]))
        add_position(found, {chunk.x[i], chunk.y[i], chunk.z[i]});
  });
  for (std::vector<float>* const values : {&found.x, &found.y, &found.z})
    *values = source.team().joined(std::move(*values));
  return found;
}

Survey survey_particles(const ParticleSource& source) {
  Team& team = source.team();
  const double stated = source.particle_radius();
  if (!(stated >= 0) || !std::isfinite(stated))
    throw InputError("particles: particle_radius is " + printed("%g", stated) +
                     ", must be > 0 and finite, or 0 where it is not known");
  Survey survey;
  survey.size = source.size();
  if (survey.size < 0)
    throw InputError("particles: there are " + std::to_string(survey.size) +
                     " of them, must be 0 or more");
  Found found;
  const double share =
      static_cast<double>(kSample) / static_cast<double>(std::max<std::int64_t>(1, survey.size));
  const std::uint32_t most =
      share >= 1 ? UINT32_MAX : static_cast<std::uint32_t>(share * 4294967296.0);
  Middle middle;
  const auto add_radii = [&](const ParticleChunk& chunk) {
    for (std::size_t i = 0; i < chunk.count; ++i)
      if (finite(chunk.x[i], chunk.y[i], chunk.z[i])) middle.add(chunk.radius[i]);
  };
  for_each_chunk(source, kMostChunk, {.radius = true}, [&](const ParticleChunk& chunk) {
    std::vector<RunsFound> parts((chunk.count + kPart - 1) / kPart);
    parallel_for(parts.size(), 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k)
        parts[k] = look_at(chunk, k * kPart, std::min((k + 1) * kPart, chunk.count), most);
    });
    for (const RunsFound& part : parts) {
      found = merged({found, part.found});
      survey.sample.insert(survey.sample.end(), part.sample.begin(), part.sample.end());
    }
    if (!chunk.radius.empty()) add_radii(chunk);
  });
  found = merged(team.joined(std::vector<Found>{found}));
  if (found.first_bad_radius != kNoParticle) {
    const double bad = found.bad_radius;
    throw InputError(Notice{.code = Code::bad_radius,
                            .text = source.name(found.first_bad_radius) + ": radius is " +
                                    printed("%g", bad) + ", must be > 0 and finite (give " +
                                    setting("particle-radius") + " to override)",
                            .place = found.first_bad_radius,
                            .found = bad});
  }
  survey.sample = team.joined(std::move(survey.sample));
  survey.finite = found.finite;
  if (found.first_bad != kNoParticle) survey.first_bad = found.first_bad;
  if (survey.finite > 0) {
    survey.low = found.low;
    survey.high = found.high;
  }
  if (source.has_radius() && survey.finite > 0) {
    survey.least_radius = found.least_radius;
    survey.largest_radius = found.largest_radius;
    middle.narrow(team, survey.finite);
    for_each_chunk(source, kMostChunk, {.radius = true}, add_radii);
    survey.middle_radius = middle.value(team);
  }
  return survey;
}

}  // namespace meniscus
