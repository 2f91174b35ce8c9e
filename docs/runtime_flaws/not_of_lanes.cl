// Oclgrind 21.10: where a vector's comparison is used both as it is and negated, the negated one has
// the lanes 1 and 0 for -1 and 0, and select(), which looks at the highest bit, takes the wrong
// ones. The same of a scalar works, and so does select() with its first two arguments swapped.
kernel void not_of_lanes(global const float* values, global int* chosen) {
  const int i = get_global_id(0) * 16;
  const float8 a = vload8(0, values + i), b = vload8(0, values + i + 8);
  const int8 less = a < b;
  vstore8(less, 0, chosen + i);
  vstore8(select((int8)(0), (int8)(1), !less), 0, chosen + i + 8);  // 1 where a >= b; found: 0
}
