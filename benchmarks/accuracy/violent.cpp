#include "accuracy/violent.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <utility>

#include "accuracy/random.hpp"
#include "accuracy/shapes.hpp"

namespace meniscus::accuracy {
namespace {

using Distance = std::function<double(const Vec3d&)>;
using Thread = std::vector<Bead>;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kThin = 1.15, kBulb = 1.6;  // s; radii of ligaments and of their tips

struct Box {
  Vec3d low, high;
  void add(const Vec3d& p, double room) {
    low = {std::min(low.x, p.x - room), std::min(low.y, p.y - room), std::min(low.z, p.z - room)};
    high = {std::max(high.x, p.x + room), std::max(high.y, p.y + room),
            std::max(high.z, p.z + room)};
  }
};

struct Water {
  Distance distance;
  Box box;  // holds it, with room for its distances
};

/// Bulk water in a box, with threads that melt into it and into each other.
Water water(Distance bulk, Box box, std::vector<Thread> threads) {
  constexpr double kBlend = 1.2;  // s
  constexpr double kRoom = 2;     // s
  std::vector<Bead> around;       // each thread: a ball
  for (const Thread& thread : threads) {
    Bead ball{{}, 0};
    for (const Bead& bead : thread) {
      ball.centre += bead.centre / static_cast<double>(thread.size());
      box.add(bead.centre, bead.radius);
    }
    for (const Bead& bead : thread)
      ball.radius = std::max(ball.radius, length(bead.centre - ball.centre) + bead.radius);
    around.push_back(ball);
  }
  box.add(box.low, kRoom);
  box.add(box.high, kRoom);
  return {[=, bulk = std::move(bulk), threads = std::move(threads)](const Vec3d& p) {
            // What is farther than the band has no say.
            double distance = std::min(bulk(p), kBand + kBlend);
            for (std::size_t k = 0; k < threads.size(); ++k)
              if (length(p - around[k].centre) - around[k].radius < distance + kBlend)
                distance = melted(distance, thread_distance(p, threads[k]), kBlend);
            return distance;
          },
          box};
}

/// A ballistic path.
struct Flight {
  Vec3d start, speed;
  double fall = 0;  // half of the acceleration downwards
  Vec3d at(double t) const { return start + t * speed - Vec3d{0, 0, fall * t * t}; }
};

/// A ligament along the flight for t in [0, end], from `foot` s of radius to its thin part and a
/// bulb, and `drops` drops that it has shed.
void add_ligament(const Flight& flight, double end, double foot, int drops, Random& random,
                  std::vector<Thread>& threads) {
  constexpr int kBeads = 12;
  Thread ligament;
  for (int k = 0; k <= kBeads; ++k) {
    const double t = 1. * k / kBeads;
    const double radius =
        kThin + (foot - kThin) * std::exp(-4 * t) + (kBulb - kThin) * smooth_step(0.75, 1, t);
    ligament.push_back({flight.at(t * end), radius});
  }
  threads.push_back(std::move(ligament));
  double t = end, last = kBulb;
  for (int k = 0; k < drops; ++k) {
    const double radius = random.uniform(1.1, 2.1);
    t += (last + radius + random.uniform(0.8, 2.5)) / length(flight.speed);
    last = radius;
    threads.push_back({{flight.at(t) + random.in_box({-.6, -.6, -.6}, {.6, .6, .6}), radius}});
  }
}

/// A slab of water with round edges and its level at z = 0.
Distance pool(double half_x, double half_y, double depth) {
  constexpr double kRound = 2;  // s
  return [=](const Vec3d& p) {
    return box_distance(p + Vec3d{0, 0, depth / 2},
                        {half_x - kRound, half_y - kRound, depth / 2 - kRound}) -
           kRound;
  };
}

/// A wall of revolution that stands in a pool with a pit, its rim thick and wavy, fingers on it.
Water crown() {
  constexpr int kFingers = 15;
  constexpr double kRim = 20, kHeight = 11;  // s
  const auto wave = [](double angle) {
    return 1.1 * std::cos(kFingers * angle) + 0.8 * std::cos(3 * angle + 1);
  };
  Random random(5);
  std::vector<Thread> threads;
  for (int k = 0; k < kFingers; ++k) {
    const double angle = k * kTurn / kFingers;
    const Vec3d out{std::cos(angle), std::sin(angle), 0};
    const Vec3d speed{0.55 * out.x + 0.15 * random.uniform(-1, 1),
                      0.55 * out.y + 0.15 * random.uniform(-1, 1), random.uniform(0.75, 1)};
    const Flight flight{kRim * out + Vec3d{0, 0, kHeight + wave(angle) - 1}, speed, 0.012};
    add_ligament(flight, random.uniform(3, 11), 1.9, k % 3 + (k % 5 == 0), random, threads);
  }
  const Thread profile{{{14, 0, -3}, 2.6},  {{14.6, 0, 0}, 2},   {{15.8, 0, 3}, 1.5},
                       {{17.3, 0, 6}, 1.3}, {{18.8, 0, 9}, 1.2}, {{kRim, 0, kHeight}, 1.7}};
  const Distance slab = [](const Vec3d& p) {
    const Vec3d q{std::hypot(p.x, p.y), 0, p.z + 3};
    return box_distance(q, {28, 1, 1}) - 2;
  };
  return water(
      [=](const Vec3d& p) {
        const double pit = length(p - Vec3d{0, 0, 16}) - 18.5;
        const double base = -melted(-slab(p), pit, 3);
        const double lift = wave(std::atan2(p.y, p.x)) * smooth_step(0, kHeight, p.z);
        const double wall = thread_distance({std::hypot(p.x, p.y), 0, p.z - lift}, profile);
        return melted(base, wall, 4);
      },
      {{-30, -30, -6}, {30, 30, 14}}, std::move(threads));
}

/// A thread along x whose radius waves more and more: where it is thin it is torn, and a ligament
/// or a satellite drop remains.
void add_jet(const Flight& path, double end, double radius, double wave, double growth,
             Random& random, std::vector<Thread>& threads) {
  constexpr double kStep = 0.7, kTorn = 1;  // s
  Thread thread;
  const auto cut = [&] {
    if (!thread.empty()) threads.push_back(std::exchange(thread, {}));
  };
  for (double t = 0; t < end; t += kStep) {
    const double swing = 0.08 * radius * std::exp(t / growth);
    const double here = std::min(radius + swing * std::cos(kTurn * t / wave), 1.35 * radius);
    const Vec3d sway = 0.035 * t * Vec3d{0, std::sin(kTurn * t / 23), std::cos(kTurn * t / 29)};
    if (here > kTorn) {
      thread.push_back({path.at(t) + sway, here});
    } else if (!thread.empty()) {
      cut();
      const Vec3d middle = path.at(t + 0.12 * wave) + sway;
      if (random.uniform(0, 1) < 0.8)
        threads.push_back(
            {{middle + random.in_box({-1, -1, -1}, {1, 1, 1}), random.uniform(1.05, 1.5)}});
    }
  }
  cut();
}

Water jet() {
  Random random(6);
  std::vector<Thread> threads;
  const Flight thick{{-36, -4, 11}, {1, 0.04, 0}, 0.005},
      thin{{-36, 9, -6}, {1, -0.05, 0.25}, 0.003};
  add_jet(thick, 74, 3.6, 13, 17, random, threads);
  add_jet(thin, 74, 2.1, 9, 21, random, threads);
  for (int k = 0; k < 9; ++k) {  // what the thick jet throws aside
    const Vec3d from = thick.at(6 + 6.5 * k);
    const double angle = random.uniform(0, kTurn);
    const Vec3d speed{0.7, std::cos(angle), std::sin(angle)};
    add_ligament({from, speed / length(speed), 0.01}, random.uniform(7, 13), 2.2,
                 static_cast<int>(random.uniform(0, 4)), random, threads);
  }
  for (int k = 0; k < 24; ++k)
    threads.push_back({{random.in_box({-10, -16, -14}, {36, 12, 16}), random.uniform(1.05, 1.9)}});
  return water([](const Vec3d&) { return kBand; }, {}, std::move(threads));
}

/// A hole in the plane, or a gap at its edge.
struct Disc {
  double x, y, radius;
};

/// A bent sheet with thick round rims, holes in it and fingers at its edge, over a pool.
Water holes() {
  const std::vector<Disc> discs{{-13, 5, 4.5}, {-4.5, 8, 3},  {-6, -5, 5.5}, {5, -1, 2.2},
                                {12, 7, 5},    {14, -6, 3.6}, {4.5, 7.5, 2}, {-17, -7, 2.5}};
  const auto height = [](double x, double y) {
    return 9 + 2.2 * std::sin(0.16 * x + 0.5) + 1.5 * std::sin(0.21 * y - 0.11 * x);
  };
  // Of the sheet's outline in the plane, positive outside: a rectangle with a wavy edge.
  const auto outside = [discs](double x, double y) {
    const double qx = std::abs(x) - 18 + 1.1 * std::cos(kTurn * y / 9);
    const double qy = std::abs(y) - 9 + 1.3 * std::cos(kTurn * x / 8);
    double edge =
        std::hypot(std::max(qx, 0.), std::max(qy, 0.)) + std::min(std::max(qx, qy), 0.) - 4;
    for (const Disc& disc : discs)
      edge = std::max(edge, disc.radius - std::hypot(x - disc.x, y - disc.y));
    return edge;
  };
  Random random(7);
  std::vector<Thread> threads;
  for (int k = 0; k < 14; ++k) {
    const double side = k % 2 ? 1 : -1, x = -19 + 2.9 * k;
    const Flight flight{{x, 12.5 * side, height(x, 12.5 * side)},
                        {0.25 * random.uniform(-1, 1), side, random.uniform(-.1, .5)},
                        0.02};
    add_ligament(flight, random.uniform(3, 8), 1.9, k % 3, random, threads);
  }
  for (int k = 0; k < 12; ++k)
    threads.push_back({{random.in_box({-24, -16, 2}, {24, 16, 18}), random.uniform(1.05, 2)}});
  const Distance below = pool(30, 24, 5);
  return water(
      [=](const Vec3d& p) {
        constexpr double kHalf = 1.15, kRim = 1.6, kSteepest = 1.13;
        const double up = (p.z - height(p.x, p.y)) / kSteepest, out = outside(p.x, p.y) + kRim;
        const double sheet = std::hypot(std::max(out, 0.), up) - kHalf;
        const double rim = std::hypot(out, up) - kRim;
        return std::min(below(p + Vec3d{0, 0, 6}), melted(sheet, rim, 2));
      },
      {{-30, -24, -11}, {30, 24, 16}}, std::move(threads));
}

/// A wave in a pool whose lip falls over and ends in fingers.
Water breaker() {
  constexpr double kHalf = 26, kRadius = 7.5;  // s; half length of the crest, radius of the lip
  const Vec3d centre{5, 0, 6.5};               // of the lip's arc
  // How far the lip has come round at y, degrees from the top.
  const auto reach = [](double y) {
    return 78 + 18 * std::cos(0.11 * y) + 9 * std::cos(kTurn * y / 6.5) +
           6 * std::cos(kTurn * y / 10.3 + 1);
  };
  Random random(8);
  std::vector<Thread> threads;
  for (double y = -23; y <= 23; y += 3.1) {
    const double angle = reach(y) * kTurn / 360;
    const Vec3d tip =
        centre + kRadius * Vec3d{std::sin(angle), 0, std::cos(angle)} + Vec3d{0, y, 0};
    const Vec3d speed{std::cos(angle) + 0.3, 0.25 * random.uniform(-1, 1), -std::sin(angle) + 0.25};
    add_ligament({tip, speed / length(speed), 0.02}, random.uniform(2, 6), 1.7,
                 static_cast<int>(random.uniform(0, 3)), random, threads);
  }
  for (double y = -21; y <= 21; y += 4.2) {  // the splash where it hits
    const Vec3d from{17 + random.uniform(-1, 2), y, -0.5};
    const Vec3d speed{random.uniform(.1, .8), random.uniform(-.4, .4), 1};
    add_ligament({from, speed / length(speed), 0.03}, random.uniform(5, 10), 2.6,
                 static_cast<int>(random.uniform(1, 4)), random, threads);
  }
  const Distance base = pool(32, kHalf, 5);
  return water(
      [=](const Vec3d& p) {
        // The wave's back, a bell; its front is the hollow under the lip.
        const double back = p.z - 14.5 * std::exp(-(p.x + 1) * (p.x + 1) / 60.);
        const double ends = std::abs(p.y) - kHalf + 2;
        double body =
            -melted(-back / 1.6, -box_distance(p - Vec3d{0, 0, 12}, {20, kHalf - 4, 15}) + 2, 3);
        const Vec3d q{p.x - centre.x, 0, p.z - centre.z};
        const double hollow = 6 - std::hypot(q.x, q.z);
        body = -melted(-body, -hollow, 1.5);
        // The lip: an arc that gets thinner, cut off by rounding where it ends.
        const double last = reach(p.y) * kTurn / 360;
        const double angle = std::clamp(std::atan2(q.x, q.z), -1.2, last);
        const double half = 1.15 + 1.3 * smooth_step(last, -1, angle);
        const Vec3d foot = kRadius * Vec3d{std::sin(angle), 0, std::cos(angle)};
        const double lip = std::hypot(length(q - foot), std::max(ends, 0.)) - half;
        return melted(melted(base(p), body, 3), lip, 2);
      },
      {{-32, -26, -5}, {32, 26, 17}}, std::move(threads));
}

/// Two jets that meet at right angles and spread to a leaf across their plane, with a thick rim.
Water collision() {
  const auto leaf = [](double angle) {  // radius of the outline, from straight down
    return 13 + 8.5 * std::cos(angle) + 1.2 * std::cos(13 * angle) + 0.5 * std::cos(22 * angle);
  };
  const auto ripple = [](double radius) { return 0.045 * radius * std::sin(kTurn * radius / 9); };
  Random random(9);
  std::vector<Thread> threads{{{{-26, 0, 26}, 3.4}, {{-1, 0, 0}, 3.2}},
                              {{{26, 0, 26}, 3.4}, {{1, 0, 0}, 3.2}}};
  for (int k = 0; k < 13; ++k) {
    const double angle = k * kTurn / 13;
    const Vec3d out{0.12 * random.uniform(-1, 1), std::sin(angle), -std::cos(angle)};
    const Vec3d rim = (leaf(angle) - 1) * Vec3d{0, std::sin(angle), -std::cos(angle)};
    add_ligament({rim, out, 0.008}, random.uniform(3, 9), 1.9, 1 + k % 3, random, threads);
  }
  return water(
      [=](const Vec3d& p) {
        constexpr double kRim = 1.7;
        const double radius = std::hypot(p.y, p.z), across = p.x - ripple(radius);
        const double out = (radius - leaf(std::atan2(p.y, -p.z))) / 1.2 + kRim;
        const double half = 1.1 + 1.2 * std::exp(-radius * radius / 40);
        const double sheet = std::hypot(std::max(out, 0.), across) - half;
        return melted(sheet, std::hypot(out, across) - kRim, 2);
      },
      {{-4, -24, -24}, {4, 24, 12}}, std::move(threads));
}

}  // namespace

Distance rounded(std::function<Field()> make) {
  constexpr double kBall = 1, kBlur = 0.3;  // s
  struct Late {
    std::once_flag once;
    Field field;
  };
  return [make = std::move(make), late = std::make_shared<Late>()](const Vec3d& p) {
    std::call_once(late->once, [&] {
      late->field = distances(blurred(opened(distances(make()), kBall), kBlur));
    });
    return late->field(p);
  };
}

std::vector<Scene> make_violent_scenes() {
  std::vector<Scene> all;
  const auto add = [&](const char* name, Use use, const Water& water, const Vec3d& eye,
                       const Vec3d& target, double focal) {
    Scene& scene = all.emplace_back();
    scene.name = name;
    scene.use = use;
    scene.distance =
        rounded([=] { return sampled(water.distance, water.box.low, water.box.high); });
    scene.low = water.box.low;
    scene.high = water.box.high;
    scene.eye = eye;
    scene.target = target;
    scene.focal = focal;
  };
  add("jet", Use::tuning, jet(), {10, -92, 34}, {0, 0, 0}, 1100);
  add("holes", Use::tuning, holes(), {28, -72, 52}, {0, -1, -1}, 1080);
  add("breaker", Use::tuning, breaker(), {70, -50, 38}, {4, 0, 1}, 1080);
  add("crown", Use::reporting, crown(), {24, -86, 54}, {0, 0, 4}, 1180);
  add("collision", Use::reporting, collision(), {62, -72, 16}, {0, 0, -2}, 1050);
  for (Scene& scene : make_frame_scenes()) all.push_back(std::move(scene));
  for (Scene& scene : all) {
    scene.safe_step = 0.9;  // the cubic between nodes can be steeper than a distance
    scene.width = 960;
    scene.height = 720;
  }
  return all;
}

}  // namespace meniscus::accuracy
