// Has an argument too many (cmake/embed.cmake).
kernel void nine_arguments(global int* a, const int b, const int c, const int d, const int e,
                           const int f, const int g, const int h, const int i) {
  a[0] = b + c + d + e + f + g + h + i;
}
