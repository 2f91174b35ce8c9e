// rusticl of Mesa 22.3 on llvmpipe: 0 - x is compiled as -x, which makes a negative zero of zero.
// fabs(x) works, where x is known not to be positive.
kernel void zero_minus(global const float* values, global float* negated) {
  const int i = get_global_id(0);
  negated[i] = 0.0f - values[i];  // of 0: wanted 0x00000000, found 0x80000000
}
