// Rusticl of Mesa 25.0 on llvmpipe: a whole struct is stored into an array in private memory, at an
// index of the work-item's own. Most entries are then not what was stored.
// Storing the members one by one works.
typedef struct {
  float value;
  int from;
} Entry;

kernel void array_of_structs(global float* value, global int* from) {
  const int i = get_global_id(0);
  Entry kept[4];
  for (int k = 0; k < 4; ++k) {
    const Entry entry = {(float)(10 * i + k), k};
    kept[(k + i) & 3] = entry;  // works: kept[(k + i) & 3].value = ...; kept[(k + i) & 3].from = k
  }
  for (int k = 0; k < 4; ++k) {
    value[4 * i + k] = kept[k].value;
    from[4 * i + k] = kept[k].from;
  }
}
