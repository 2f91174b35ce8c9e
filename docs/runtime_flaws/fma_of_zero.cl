// rusticl 22.3 on llvmpipe: with a = -3, b = 0, c = 0 this stores -0. The exact sum of -0 and +0 is +0,
// which a * b + c gives. Kernels do not fuse products into sums that may be zero.
kernel void fma_of_zero(global float* result, const float a, const float b, const float c) {
  result[0] = fma(a, b, c);
}
