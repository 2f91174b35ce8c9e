// How many steps numbers take to 1 (halve what is even, else treble it and add one), summed by their
// last four bits. Work-items that meet in a sum wait for each other.
kernel void chain_sums(global int* sum) {
  const uint number = get_global_id(0) + 1;
  int steps = 0;
  for (ulong at = number; at != 1; ++steps) at = at & 1 ? 3 * at + 1 : at / 2;
  atomic_add(sum + (number & 15), steps);
}
