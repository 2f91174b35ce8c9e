// The evidence for one quadric or two sheets in double precision, from its definition
// (roundness.hpp, roundness.cl), given the trial fits; and what follows from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "verify/reference/fit.hpp"
#include "verify/reference/sheet.hpp"

namespace meniscus::reference {

struct TrialFit {
  Vec3d position, normal;  // particle radii, unit
  double weight = 0;
  std::array<float, 10> quadric{};  // through the particles, |grad f| = 1 at this one
};

/// What one neighbour's fit says at a particle.
struct TrialWord {
  double weight = 0, f = 0;
  Vec3d gradient, place;
};

/// Of all fits within 4.5 whose normals are less than 120 degrees from that of `own`.
inline std::vector<TrialWord> words_about(const std::vector<TrialFit>& fits, std::size_t own) {
  std::vector<TrialWord> words;
  for (const TrialFit& fit : fits) {
    const Vec3d x = fits[own].position - fit.position;
    const double l = length(x) / 4.5;
    if (l >= 1 || !(fit.weight > 0) || dot(fit.normal, fits[own].normal) < -0.5) continue;
    const Vec3d gradient = gradient_at(fit.quadric, x);
    const double f = value_at(fit.quadric, x) / std::max(length(gradient), 0.3);
    words.push_back({fit.weight * std::pow(1 - l * l, 3), std::clamp(f, -0.5, 0.5),
                     normalized(gradient), fit.position});
  }
  return words;
}

/// The mean of f^2.
inline double one_quadric(const std::vector<TrialFit>& fits, std::size_t own) {
  double sum = 0, weight = 0;
  for (const TrialWord& word : words_about(fits, own)) {
    sum += word.weight * word.f * word.f;
    weight += word.weight;
  }
  return weight > 0 ? sum / weight : 0;
}

/// The mean of 1 - n.n'.
inline double bend_of(const std::vector<TrialFit>& fits, std::size_t own) {
  double sum = 0, weight = 0;
  for (const TrialFit& fit : fits) {
    const double l = length(fits[own].position - fit.position) / 4.5;
    const double same = dot(fit.normal, fits[own].normal);
    if (l >= 1 || same < -0.5) continue;
    const double w = fit.weight * std::pow(1 - l * l, 3);
    sum += w * (1 - same);
    weight += w;
  }
  return weight > 0 ? sum / weight : 0;
}

/// The mean of f^2 on the sheet that the blend would take: A around the gradient that dominates
/// after two rounds of mean shift, or B, the rest.
inline double two_sheets(const std::vector<TrialFit>& fits, std::size_t own) {
  const std::vector<TrialWord> words = words_about(fits, own);
  if (words.empty()) return 0;
  const auto same = [](const Vec3d& a, const Vec3d& b) { return smooth_step(0.7, 0.9, dot(a, b)); };
  Vec3d axis = std::max_element(words.begin(), words.end(), [](const auto& a, const auto& b) {
                 return a.weight < b.weight;
               })->gradient;
  for (int round = 0; round < 2; ++round) {
    Vec3d sum;
    for (const TrialWord& word : words)
      sum += word.gradient * (word.weight * same(word.gradient, axis));
    axis = normalized(sum);
  }
  struct Sheet {
    double weight = 0, f = 0, squares = 0;
    Vec3d centre, normal;
  } a, b;
  const auto add = [](Sheet& sheet, const TrialWord& word, double w) {
    sheet.weight += w;
    sheet.f += w * word.f;
    sheet.squares += w * word.f * word.f;
    sheet.centre += word.place * w;
    sheet.normal += word.gradient * w;
  };
  for (const TrialWord& word : words) {
    const double share = same(word.gradient, axis);
    add(a, word, share * word.weight);
    add(b, word, (1 - share) * word.weight);
  }
  const double of_a = a.squares / a.weight;
  if (!(b.weight > 0)) return of_a;
  const Vec3d apart = b.centre / b.weight - a.centre / a.weight;
  const bool convex = dot(apart, axis) - dot(apart, normalized(b.normal)) < 0;
  const double fa = a.f / a.weight, fb = b.f / b.weight;
  if (convex ? fb <= fa : fb >= fa) return of_a;
  const double meets = smooth_step(0.003, 0.02, b.weight / (a.weight + b.weight));
  return of_a + meets * (b.squares / b.weight - of_a);
}

/// A value, and how far floats may be from it.
struct Estimate {
  double value = 0, error = 0;
};

/// f of a value that is off by as much as it may be; f itself rounds ten times.
template <class F>
Estimate passed_on(const Estimate& of, const F& f) {
  const double value = f(of.value);
  const double off = std::max(std::abs(f(of.value + of.error) - value),
                              std::abs(f(std::max(of.value - of.error, 0.0)) - value));
  return {value, 2 * off + 10 * kEpsilon * std::abs(value)};
}

/// What kernel score_bends says of a fit.
struct ScoredBend {
  Estimate share, score, bends;
};

/// Of means of the evidence at it. `share` is its own; irregular particles have `noise`, radii^2,
/// and scores that are higher by `rounder`.
inline ScoredBend scored_bend(const SheetMean& one, const SheetMean& two, const SheetMean& bend,
                              const SheetMean& apart, double share, double noise, double rounder) {
  const auto orderly = [&](double square) {
    return std::max(square - noise, std::min(square, 0.011));
  };
  const auto logarithm = [](double factor, double noise_left) {
    return [=](double x) { return factor * std::log(x + noise_left); };
  };
  const Estimate all[] = {
      passed_on({orderly(one.mean), one.error + kEpsilon * one.mean}, logarithm(-4, 0.008)),
      passed_on({orderly(two.mean) + 1.5 * apart.mean,
                 two.error + 1.5 * apart.error + kEpsilon * (two.mean + apart.mean)},
                logarithm(1.5, 0.02)),
      passed_on({orderly(two.mean), two.error + kEpsilon * two.mean},
                [&](double x) { return 30 * std::max(x - (0.03 + 2 * noise), 0.0); }),
      passed_on({std::min(bend.mean, 0.12 + 10 * noise), bend.error}, logarithm(1.5, 0.002)),
      passed_on({apart.mean, apart.error}, [](double x) { return 20 * x; })};
  ScoredBend scored;
  for (const Estimate& part : all) {
    scored.score.value += part.value;
    scored.score.error += part.error;
  }
  scored.score.value += rounder;
  scored.score.error += 20 * kEpsilon;  // of the product, and the logarithm itself
  const auto bends = [](double x) { return smooth_step(0.005, 0.02, x); };
  scored.bends = passed_on({bend.mean, bend.error}, bends);
  scored.share = passed_on({bend.mean, bend.error}, [&](double x) {
    return share * bends(x) * (smooth_step(0.02, 0.04, x) + 0.01) / std::sqrt(std::max(x, 1e-6));
  });
  return scored;
}

/// The roundness of a fit that bends so far, of the mean score around.
inline Estimate roundness_of(const SheetMean& score, double bends) {
  return passed_on({score.mean, score.error},
                   [&](double x) { return bends * smooth_step(3.48, 3.62, x); });
}

}  // namespace meniscus::reference
