// Defines a macro that the file it uses defines, too (cmake/embed.cmake).
//
// uses: defines.cl

#define REACH 4.0f

kernel void defined_twice(const int n) {}
