// How irregularly the particles of a frame lie that streams.
#pragma once

#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "stages/frame/relax.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// The disorder of a source's particles: params.disorder as in relax.hpp, or where that is below 0
/// what is measured at some 4,096 particles of the survey's sample, spread over all. For that the
/// particles are read once more, and those around these are kept: each sees what it would see in
/// the whole frame. Less than .3 counts as none. All processes of the source's team call this. The
/// result is the same in all of them; it depends neither on their number nor on the particles'
/// order. Throws InputError.
///
///   view  make_world_view()
Disorder find_disorder(const ParticleSource& source, const View& view, const Parameters& params);

}  // namespace meniscus
