// stream.cl: passes over particles that stream through the device in chunks. find_fronts makes a
// map of the nearest particles (paper 2.1 by points), select_near picks what may matter behind it.
// Cells of the map are `cell` pixels wide; those beyond the screen's edge belong to it too, and
// particles farther out count in the outermost. One work-item for WIDTH particles.

// Where WIDTH particles from the first on lie.
typedef struct {
  float depth[WIDTH];      // particle radii
  float i[WIDTH], j[WIDTH];  // in the map, cells; i < 0: behind the near plane or not near the screen
} Places;

inline Places places_of(const floatv x, const floatv y, const floatv z, const float16 from_world,
                        const float4 u_row, const float4 v_row, const float4 w_row,
                        const float4 extent,  // pixels*w per radius along u, along v; near depth;
                                              // margin, particle radii
                        const float4 map,     // 1 / cell; cells beyond the screen's edge; width and
                                              // height of the screen, pixels
                        const int2 cells) {
  const floatv px = x - from_world.sc, py = y - from_world.sd, pz = z - from_world.se;
  const floatv ex = from_world.s0 * px + from_world.s1 * py + from_world.s2 * pz + from_world.s9;
  const floatv ey = from_world.s3 * px + from_world.s4 * py + from_world.s5 * pz + from_world.sa;
  const floatv ez = from_world.s6 * px + from_world.s7 * py + from_world.s8 * pz + from_world.sb;
  const floatv w = w_row.x * ex + w_row.y * ey + w_row.z * ez + w_row.w;
  const floatv share = 1.0f / w;
  const floatv u = (u_row.x * ex + u_row.y * ey + u_row.z * ez + u_row.w) * share;
  const floatv v = (v_row.x * ex + v_row.y * ey + v_row.z * ez + v_row.w) * share;
  const floatv mu = extent.w * extent.x * share, mv = extent.w * extent.y * share;
  const floatv i = clamp(u * map.x + map.y, (floatv)(0.0f), (floatv)((float)cells.x - 0.01f));
  const floatv j = clamp(v * map.x + map.y, (floatv)(0.0f), (floatv)((float)cells.y - 0.01f));
  // A coordinate that is not a number fails these comparisons.
  const floatv kept =
      SELECT((floatv)(-1.0f), i,
             (-ez > extent.z) & (u + mu >= 0.0f) & (u - mu <= map.z) & (v + mv >= 0.0f) &
                 (v - mv <= map.w));
  Places places;
  STOREF(-ez, places.depth);
  STOREF(kept, places.i);
  STOREF(j, places.j);
  return places;
}

// The depth of the nearest particle in every cell.
kernel void find_fronts(global const float* x,  // [count] world units, padded to WIDTH
                        global const float* y, global const float* z,
                        global uint* front,  // [cells] bits of the depth; +infinity before
                        const int count, const float16 from_world, const float4 u_row,
                        const float4 v_row, const float4 w_row, const float4 extent,
                        const float4 map, const int2 cells) {
  const int first = get_global_id(0) * WIDTH;
  if (first >= count) return;
  const Places at = places_of(LOADF(x + first), LOADF(y + first), LOADF(z + first), from_world,
                              u_row, v_row, w_row, extent, map, cells);
  for (int k = 0; k < WIDTH && first + k < count; ++k)
    if (at.i[k] >= 0.0f)
      atomic_min(front + ((int)at.j[k] * cells.x + (int)at.i[k]), as_uint(at.depth[k]));
}

// The particles that lie before their block's limit: their places in the chunk, in any order, with
// the highest bit set where they are of the front layer. That is a plane through the front of their
// cell, which lies at the edge of the cell that is nearest to the camera.
kernel void select_near(global const float* x, global const float* y, global const float* z,
                        global const float4* layer,  // [cells] front; its slopes along u and v,
                                                     // per cell; thickness; particle radii
                        global const float* limit,   // [blocks] deepest depth that is of interest
                        global uint* selected,       // [count]
                        global int* selected_count,  // 0 before
                        const int count, const float16 from_world, const float4 u_row,
                        const float4 v_row, const float4 w_row, const float4 extent,
                        const float4 map, const int2 cells,
                        const int2 blocks) {  // cells along a block's side; blocks in a row
  const int first = get_global_id(0) * WIDTH;
  if (first >= count) return;
  const Places at = places_of(LOADF(x + first), LOADF(y + first), LOADF(z + first), from_world,
                              u_row, v_row, w_row, extent, map, cells);
  uint found[WIDTH];
  int n = 0;
  for (int k = 0; k < WIDTH && first + k < count; ++k) {
    if (!(at.i[k] >= 0.0f)) continue;
    const int i = (int)at.i[k], j = (int)at.j[k];
    if (!(at.depth[k] <= limit[j / blocks.x * blocks.y + i / blocks.x])) continue;
    const float4 here = layer[j * cells.x + i];
    const float along_u = at.i[k] - (float)i - (here.y >= 0.0f ? 0.0f : 1.0f);
    const float along_v = at.j[k] - (float)j - (here.z >= 0.0f ? 0.0f : 1.0f);
    const float back = here.x + here.y * along_u + here.z * along_v + here.w;
    found[n++] = (uint)(first + k) | (at.depth[k] <= back ? 0x80000000u : 0u);
  }
  if (n == 0) return;
  const int place = atomic_add(selected_count, n);
  for (int k = 0; k < n; ++k) selected[place + k] = found[k];
}
