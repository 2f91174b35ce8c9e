// How often each value occurs, wrongly: two work-items that read the same count before either has
// written lose one.
kernel void racing_histogram(global const uchar* values, volatile global int* count) {
  count[values[get_global_id(0)]] += 1;
}
