// stream.cl: passes over particles that stream through the device in chunks. find_fronts makes a
// map of the nearest particles (paper 2.1 by points), select_near picks what may matter behind it.
// Cells of the map are `cell` pixels wide; those beyond the screen's edge belong to it too, and
// particles farther out count in the outermost. One work-item for WIDTH particles.

// Where WIDTH particles from the first on lie.
typedef struct {
  float depth[WIDTH];      // particle radii
  float i[WIDTH], j[WIDTH];  // in the map, cells; i < 0: behind the near plane or not near the screen
} Places;

inline Places places_of(const floatv x, const floatv y, const floatv z, const Projection to,
                        const FrontCells map) {
  const floatv px = x - to.origin[0], py = y - to.origin[1], pz = z - to.origin[2];
  const floatv ex = to.rotation[0] * px + to.rotation[1] * py + to.rotation[2] * pz + to.shift[0];
  const floatv ey = to.rotation[3] * px + to.rotation[4] * py + to.rotation[5] * pz + to.shift[1];
  const floatv ez = to.rotation[6] * px + to.rotation[7] * py + to.rotation[8] * pz + to.shift[2];
  const floatv w = to.w_row[0] * ex + to.w_row[1] * ey + to.w_row[2] * ez + to.w_row[3];
  const floatv share = 1.0f / w;
  const floatv u = (to.u_row[0] * ex + to.u_row[1] * ey + to.u_row[2] * ez + to.u_row[3]) * share;
  const floatv v = (to.v_row[0] * ex + to.v_row[1] * ey + to.v_row[2] * ez + to.v_row[3]) * share;
  const floatv mu = to.margin * to.u_scale * share, mv = to.margin * to.v_scale * share;
  const floatv i =
      clamp(u * map.per_pixel + map.border, (floatv)(0.0f), (floatv)((float)map.nx - 0.01f));
  const floatv j =
      clamp(v * map.per_pixel + map.border, (floatv)(0.0f), (floatv)((float)map.ny - 0.01f));
  // A coordinate that is not a number fails these comparisons.
  const floatv kept =
      SELECT((floatv)(-1.0f), i,
             (-ez > to.near_depth) & (u + mu >= 0.0f) & (u - mu <= to.width) & (v + mv >= 0.0f) &
                 (v - mv <= to.height));
  Places places;
  STOREF(-ez, places.depth);
  STOREF(kept, places.i);
  STOREF(j, places.j);
  return places;
}

// The depth of the nearest particle in every cell.
kernel void find_fronts(POINTS(x, y, z),     // [count] world units, padded to WIDTH
                        global uint* front,  // [cells] bits of the depth; +infinity before
                        const int count, const Projection to, const FrontCells map) {
  const int first = get_global_id(0) * WIDTH;
  if (first >= count) return;
  const Places at = places_of(LOADF(x + first), LOADF(y + first), LOADF(z + first), to, map);
  for (int k = 0; k < WIDTH && first + k < count; ++k)
    if (at.i[k] >= 0.0f)
      atomic_min(front + ((int)at.j[k] * map.nx + (int)at.i[k]), as_uint(at.depth[k]));
}

// The particles that lie before their block's limit: their places in the chunk, in any order, with
// the highest bit set where they are of the front layer. That is a plane through the front of their
// cell, which lies at the edge of the cell that is nearest to the camera.
kernel void select_near(POINTS(x, y, z),
                        global const float4* layer,  // [cells] front; its slopes along u and v,
                                                     // per cell; thickness; particle radii
                        global const float* limit,   // [blocks] deepest depth that is of interest
                        global uint* selected,       // [count]
                        global int* selected_count,  // 0 before
                        const int count, const Projection to,
                        const FrontCells map) {
  const int first = get_global_id(0) * WIDTH;
  if (first >= count) return;
  const Places at = places_of(LOADF(x + first), LOADF(y + first), LOADF(z + first), to, map);
  uint found[WIDTH];
  int n = 0;
  for (int k = 0; k < WIDTH && first + k < count; ++k) {
    if (!(at.i[k] >= 0.0f)) continue;
    const int i = (int)at.i[k], j = (int)at.j[k];
    if (!(at.depth[k] <= limit[j / map.block * map.blocks + i / map.block])) continue;
    const float4 here = layer[j * map.nx + i];
    const float along_u = at.i[k] - (float)i - (here.y >= 0.0f ? 0.0f : 1.0f);
    const float along_v = at.j[k] - (float)j - (here.z >= 0.0f ? 0.0f : 1.0f);
    const float back = here.x + here.y * along_u + here.z * along_v + here.w;
    found[n++] = (uint)(first + k) | (at.depth[k] <= back ? 0x80000000u : 0u);
  }
  if (n == 0) return;
  const int place = atomic_add(selected_count, n);
  for (int k = 0; k < n; ++k) selected[place + k] = found[k];
}
