// sheet.cl: means over the fits of the same sheet around each fit (docs/method.md, fit and trust).

// Up to WIDTH fits of one cell at a time, BLOCK a work-item. A fit at distance l whose normal is n'
// weighs
//   share (1 - l / reach) smoothstep(low, high, n.n').
kernel void average_on_sheets(
    global float* mean,          // [2][n] of the values; 0 where nothing weighs anything
    global const float* cell_x,  // [n] in bucket order
    global const float* cell_y, global const float* cell_z, global const uint* cell_tag,
    global const int* cell_start, const float inverse_cell, const uint mask, const int n,
    global const float* normal,  // [3][n] in bucket order
    global const float* share,   // [n]
    global const float* value,   // [2][n]
    const float reach, const float low, const float high) {
  const Cells cells = {cell_x, cell_y, cell_z, cell_tag, cell_start, inverse_cell, mask};
  const int begin = get_global_id(0) * BLOCK, end = min(begin + BLOCK, n);
  const floatv none = (floatv)(0.0f);
  for (int first = begin; first < end;) {
    const Together own = particles_together(cells, first, end, n);
    const floatv x = LOADF(cell_x + first), y = LOADF(cell_y + first), z = LOADF(cell_z + first);
    const floatv nx = LOADF(normal + first), ny = LOADF(normal + n + first),
                 nz = LOADF(normal + 2 * n + first);
    floatv weight = none, a = none, b = none;
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j) {
        const uint tag = tag_of(own.cx, own.cy + j, own.cz + k);
        Row row = row_of(own.cx - 1, own.cy + j, own.cz + k, 3, mask);
        while (next_range(&row, cell_start, mask))
          for (int p = row.begin; p < row.end; ++p) {
            if (!SAME_ROW(cell_tag[p], tag)) continue;
            const floatv dx = x - cell_x[p], dy = y - cell_y[p], dz = z - cell_z[p];
            const floatv near = 1.0f - sqrt(dx * dx + dy * dy + dz * dz) * (1.0f / reach);
            const floatv same = nx * normal[p] + ny * normal[n + p] + nz * normal[2 * n + p];
            const floatv w =
                share[p] * SELECT(none, near, near > 0.0f) * smooth_step(low, high, same);
            weight += w;
            a += w * value[p];
            b += w * value[n + p];
          }
      }
    const floatv scale = SELECT(none, 1.0f / weight, weight > 0.0f);
    scatter_float(a * scale, mean, own.at, own.used);
    scatter_float(b * scale, mean + n, own.at, own.used);
    first += own.count;
  }
}
