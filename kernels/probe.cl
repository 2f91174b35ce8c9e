// probe.cl: what a device can do at most, as the benchmarks measure it (src/device/probe.hpp).

// Reads and writes WIDTH values an item, four where that is 1: a GPU starts items no faster than it
// could copy as many floats.
kernel void copy_values(global const float* from, global float* to) {
#if WIDTH == 1
  const int i = get_global_id(0);
  vstore4(vload4(i, from), i, to);
#else
  const int i = get_global_id(0) * WIDTH;
  STOREF(LOADF(from + i), to + i);
#endif
}

// Eight chains of fused multiply-adds an item, each 16 long a round: more than enough to hide the
// latency of an fma, and few enough for sixteen registers. 8 * 16 * 2 operations a lane and round.
kernel void fuse_multiply_add(global float* result, const int rounds, const float factor,
                              const float addend) {
  const int i = get_global_id(0) * WIDTH;
  const floatv f = (floatv)(factor), c = (floatv)(addend);
  floatv a[8];
#pragma unroll
  for (int k = 0; k < 8; ++k) a[k] = (floatv)((float)k);
  for (int round = 0; round < rounds; ++round) {
#pragma unroll
    for (int step = 0; step < 16; ++step) {
#pragma unroll
      for (int k = 0; k < 8; ++k) a[k] = fma(a[k], f, c);
    }
  }
  STOREF(a[0] + a[1] + a[2] + a[3] + a[4] + a[5] + a[6] + a[7], result + i);
}

// The same without fusing, as most kernels compute: six chains of products and six of sums, 16 long
// a round. 12 * 16 operations a lane and round.
kernel void multiply_and_add(global float* result, const int rounds, const float factor,
                             const float addend) {
  const int i = get_global_id(0) * WIDTH;
  const floatv f = (floatv)(factor), c = (floatv)(addend);
  floatv a[6], b[6];
#pragma unroll
  for (int k = 0; k < 6; ++k) {
    a[k] = (floatv)((float)k);
    b[k] = (floatv)((float)k);
  }
  for (int round = 0; round < rounds; ++round) {
#pragma unroll
    for (int step = 0; step < 16; ++step) {
#pragma unroll
      for (int k = 0; k < 6; ++k) {
        a[k] *= f;
        b[k] += c;
      }
    }
  }
  STOREF(a[0] + a[1] + a[2] + a[3] + a[4] + a[5] + b[0] + b[1] + b[2] + b[3] + b[4] + b[5],
         result + i);
}

// One atomic minimum an item, on word (item & mask).
kernel void lower_words(global uint* words, const uint mask) {
  const uint i = get_global_id(0);
  atomic_min(words + (i & mask), 0x7fffffffu - i);
}

// What a launch costs by itself.
kernel void write_one(global float* result) { result[get_global_id(0)] = 1.0f; }
