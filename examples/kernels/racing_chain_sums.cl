// chain_sums.cl with a race: what others add between a work-item's reading and writing is lost.
kernel void racing_chain_sums(volatile global int* sum) {
  const uint number = get_global_id(0) + 1;
  int steps = sum[number & 15];
  for (ulong at = number; at != 1; ++steps) at = at & 1 ? 3 * at + 1 : at / 2;
  sum[number & 15] = steps;
}
