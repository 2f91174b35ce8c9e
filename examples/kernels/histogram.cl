// How often each value occurs. Work-items that meet in a bin wait for each other.
kernel void histogram(global const uchar* values, volatile global int* count) {
  atomic_inc(count + values[get_global_id(0)]);
}
