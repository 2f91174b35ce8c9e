// fill.cl: fills large buffers where commands that do so run on one processor alone.

// Sixteen words of the same value. One work-item per sixteen words.
kernel void fill_words(global uint* words,  // [16 n] out
                       const uint value, const int n) {
  const int k = get_global_id(0);
  if (k < n) vstore16((uint16)(value), k, words);
}
