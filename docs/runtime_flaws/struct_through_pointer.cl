// rusticl of Mesa 22.3 on llvmpipe: clCreateKernel crashes (SIGSEGV in a NIR pass).
// A whole struct is copied from an index that the compiler does not know, through a pointer to a
// variable that is no array. Reading the members through the pointer works, and so does an array
// of one struct.
typedef struct {
  float x, y;
} Pair;

inline float sum_of(const Pair* pairs, const int count) {
  float sum = 0.0f;
  for (int k = 0; k < count; ++k) {
    const Pair pair = pairs[k];  // works: const Pair* pair = pairs + k
    sum += pair.x * pair.y;
  }
  return sum;
}

kernel void struct_through_pointer(global float* values) {
  const Pair pair = {values[0], values[1]};
  values[2] = sum_of(&pair, 1);
}
