// parts: a frame in several files, of which each process of a team reads its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/team.hpp"
#include "meniscus/io.hpp"
#include "meniscus/source.hpp"

namespace meniscus {

/// Whether `a` comes before `b` when the numbers in them count as numbers: part 2 before part 10.
bool naturally_before(const std::string& a, const std::string& b);

/// The files that an input stands for: itself, or where it has a * and there is no file of just
/// that name all that match, in natural order; a * stands for any characters of a file's or
/// folder's name. Throws InputError when none matches, or where a folder cannot be listed.
std::vector<std::string> part_files(const std::string& path);

/// Opens a frame (see open_particles), of which each process of the team reads a share. Where there
/// are at least as many parts as ranks, rank k of n reads parts k, k + n, ... Else it reads a range
/// of each part that can be left on disk; the others belong to one rank as a whole.
/// All ranks call this. Throws InputError in all of them.
std::unique_ptr<ParticleSource> open_parts(const std::string& path, const ReadOptions& options,
                                           Team& team);

}  // namespace meniscus
