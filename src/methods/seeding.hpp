// The places that get a quadric: what tells the methods fit, stable and groups apart.
#pragma once

#include "methods/shell.hpp"

namespace meniscus {

/// Method fit: every particle of the rim.
extern const Seeding kEveryParticle;

/// Method stable: the seen particles, as in the paper. The hidden ones of the rim help to tell what
/// the surface is like; without them edges at outlines came out rounded (docs/method_decisions.md).
extern const Seeding kSeenParticles;

/// Method groups: what is left when nothing merges any more. Every particle tells what the surface
/// is like, in a group or not: of groups alone, creases came out rounded
/// (docs/method_decisions.md).
extern const Seeding kMergedGroups;

}  // namespace meniscus
