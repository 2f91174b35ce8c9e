// PoCL 3.0 of PyPI (pocl-binary-distribution), on processors without AVX-512: built for the first
// time the program works; the next process gets it from PoCL's cache without any kernel, and
// clCreateKernel says CL_INVALID_KERNEL_NAME. The build succeeds both times; its log warns that
// "AVX vector argument of type float16 without 'avx512f' enabled changes the ABI". Two float8 work.
kernel void sixteen_floats(global const float16* values, global float16* least) {
  const int i = get_global_id(0);
  least[i] = fmin(values[i], least[i]);
}
