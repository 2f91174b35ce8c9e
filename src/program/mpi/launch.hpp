// launch: whether mpirun or srun started this process as one of several, and their team.
#pragma once

#include "base/team.hpp"

namespace meniscus {

/// This process among those that were started together.
struct Launch {
  int rank = 0, size = 1;
};

/// As Open MPI, PMIx or PMI say in the environment. MPI is not started.
Launch launch();

/// The team of the processes that were started together, alone() where it is only this one. The
/// first call starts MPI. Throws Error where several were started and this program has no MPI.
Team& launched_team();

/// Whether launched_team() has made a team of several.
bool has_team();

/// Ends the team after a success or an error of this process: waits for the others, and returns the
/// line that is to be shown, the error of whoever failed first; empty: none did. Any number of
/// calls, before launched_team(), too.
std::string end_team(const std::string& error);

/// Leaves MPI, after end_team and when all has been said. Until rank 0 is here no other process
/// ends, so that mpirun stops nobody who still has something to say.
void leave_team();

}  // namespace meniscus
