/* Runs the launch that launch.txt describes and says whether it leaves the bits that it should:
     ./host [DEVICE [RUNS]]
   DEVICE: the first one with this in its name or its platform's; else that of launch.txt, or any.
   RUNS: so many at most, until one differs; else 20, and more until 10 s have passed: a race is lost
   in some runs alone. Exit code 0: the expected bits; 1: others in any run; 2: it did not run. */
#define _POSIX_C_SOURCE 200112L
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_ARGUMENTS = 64, MOST_TEXT = 1 << 16, MOST_SOURCE = 1 << 24 };

struct argument {
  char name[256];
  int is_buffer, floats;
  size_t entry;       /* bytes of an entry of a list in any order; 0: the values have an order */
  size_t bytes, room; /* of the values, of the buffer, which holds zeros behind them */
  unsigned char *before, *expected, *found, *first; /* expected: null where it is not known */
  cl_mem memory;
};

static struct argument arguments[MOST_ARGUMENTS];
static int count;
static char kernel_name[256], options[MOST_TEXT], wanted_device[MOST_TEXT];
static size_t global[2], local[2], entry_bytes; /* the last for qsort */
static void fail(const char* what, const char* why) {
  fprintf(stderr, "host: %s %s\n", what, why);
  exit(2);
}

static void check(const char* call, cl_int code) {
  char why[64];
  sprintf(why, "failed with %d (CL/cl.h has its name)", (int)code);
  if (code != CL_SUCCESS) fail(call, why);
}
#define CALL(function, arguments) check(#function, function arguments)

static unsigned char* zeros(size_t bytes) {
  unsigned char* memory = calloc(bytes + 1, 1);
  if (!memory) fail("memory", "is not enough");
  return memory;
}

/* The first `bytes` bytes of a file in memory for `room` bytes, zeros behind them. */
static unsigned char* read_bytes(const char* name, size_t bytes, size_t room) {
  unsigned char* memory = zeros(room);
  FILE* file = fopen(name, "rb");
  if (!file || fread(memory, 1, bytes, file) != bytes) fail(name, "is missing or cut off");
  fclose(file);
  return memory;
}

static void read_launch(void) {
  static char line[MOST_TEXT], text[MOST_TEXT], name[256], value[256];
  FILE* file = fopen("launch.txt", "r");
  if (!file) fail("launch.txt", "cannot be read (start this in its folder)");
  while (fgets(line, sizeof line, file)) {
    struct argument* a = &arguments[count];
    if (sscanf(line, "environment %255s %255s", name, value) == 2) setenv(name, value, 0);
    sscanf(line, "device %65535[^\n]", wanted_device);
    sscanf(line, "kernel %255s", kernel_name);
    sscanf(line, "options %65535[^\n]", options);
    sscanf(line, "range %zu %zu groups %zu %zu", global, global + 1, local, local + 1);
    if (count == MOST_ARGUMENTS) fail("launch.txt", "has too many arguments");
    if (sscanf(line, "buffer %255s floats %d entry %zu bytes %zu room %zu %255s %255s", a->name,
               &a->floats, &a->entry, &a->bytes, &a->room, name, value) == 7) {
      a->is_buffer = 1, a->found = zeros(a->room), a->first = zeros(a->room);
      a->before = read_bytes(name, a->bytes, a->room);
      if (strcmp(value, "-")) a->expected = read_bytes(value, a->bytes, a->room);
      ++count;
    } else if (sscanf(line, "scalar %255s %65535s", a->name, text) == 2) {
      a->before = zeros(strlen(text) / 2);
      for (; a->bytes < strlen(text) / 2; ++a->bytes)
        sscanf(text + 2 * a->bytes, "%2hhx", a->before + a->bytes);
      ++count;
    }
  }
  fclose(file);
}

/* The first device with `part` in its name or its platform's; null: the one of launch.txt. */
static cl_device_id find_device(const char* part) {
  static char name[MOST_TEXT], platform_name[MOST_TEXT];
  cl_platform_id platforms[32];
  cl_device_id first = NULL, chosen = NULL, devices[32];
  cl_uint platform_count = 0, device_count, p, d;
  CALL(clGetPlatformIDs, (32, platforms, &platform_count));
  for (p = 0; p < platform_count && p < 32; ++p) {
    clGetPlatformInfo(platforms[p], CL_PLATFORM_NAME, MOST_TEXT, platform_name, NULL);
    if (clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, 32, devices, &device_count)) continue;
    for (d = 0; d < device_count && d < 32 && !chosen; ++d) {
      clGetDeviceInfo(devices[d], CL_DEVICE_NAME, MOST_TEXT, name, NULL);
      if (!first) first = devices[d];
      if (part ? strstr(name, part) || strstr(platform_name, part) : !strcmp(name, wanted_device))
        chosen = devices[d];
    }
  }
  if (!chosen && !part) chosen = first;
  if (!chosen) fail("no OpenCL device", part ? "has this in its name" : "was found");
  CALL(clGetDeviceInfo, (chosen, CL_DEVICE_NAME, MOST_TEXT, name, NULL));
  fprintf(stderr, "%s on %s\n", kernel_name, name);
  return chosen;
}

static int in_order(const void* a, const void* b) { return memcmp(a, b, entry_bytes); }

static void print_grouped(size_t number, const char* end) { /* 1234 as "1,234" */
  if (number >= 1000) print_grouped(number / 1000, "");
  printf(number >= 1000 ? ",%03zu%s" : "%zu%s", number % 1000, end);
}

union value {
  unsigned bits;
  float number;
};
static void print_value(union value v, int floats, const char* end) {
  printf("0x%08x (", v.bits);
  floats ? printf("%.9g", (double)v.number) : printf("%d", (int)v.bits);
  printf(")%s", end);
}

/* Whether the values differ; says how, in the words of the README. NaN is like NaN. */
static int differs(struct argument* a, unsigned char* wanted, const char* run) {
  size_t k, differing = 0, first = 0, words = (a->bytes + 3) / 4;
  union value w, f, first_wanted = {0}, first_found = {0};
  if ((entry_bytes = a->entry)) {
    qsort(wanted, a->bytes / a->entry, a->entry, in_order);
    qsort(a->found, a->bytes / a->entry, a->entry, in_order);
  }
  if (!memcmp(wanted, a->found, a->bytes)) return 0;
  for (k = 0; k < words; ++k) {
    memcpy(&w, wanted + 4 * k, 4);
    memcpy(&f, a->found + 4 * k, 4);
    if (w.bits == f.bits) continue;
    if (a->floats && w.number != w.number && f.number != f.number) continue;
    if (differing++ == 0) first = k, first_wanted = w, first_found = f;
  }
  printf("%s: argument %s: ", run, a->name);
  if (!differing) return puts("only the bits of what is no number differ"), 1;
  print_grouped(differing, " of "), print_grouped(words, "");
  printf(" values differ, the first at %zu: found ", first);
  print_value(first_found, a->floats, ", wanted ");
  print_value(first_wanted, a->floats, "\n");
  return 1;
}

int main(int argc, char** argv) {
  const time_t end = time(NULL) + 10;
  static char text[MOST_TEXT];
  char* source = (char*)zeros(MOST_SOURCE);
  int k, run, different = 0, most = argc > 2 ? atoi(argv[2]) : 0;
  cl_int code;
  read_launch();
  cl_device_id device = find_device(argc > 1 && *argv[1] ? argv[1] : NULL);
  cl_context context = clCreateContext(NULL, 1, &device, NULL, NULL, &code);
  check("clCreateContext", code);
  cl_command_queue queue = clCreateCommandQueue(context, device, 0, &code);
  check("clCreateCommandQueue", code);
  FILE* file = fopen("kernel.cl", "rb");
  if (!file || !fread(source, 1, MOST_SOURCE, file)) fail("kernel.cl", "cannot be read");
  fclose(file);
  cl_program program = clCreateProgramWithSource(context, 1, (const char**)&source, NULL, &code);
  check("clCreateProgramWithSource", code);
  code = clBuildProgram(program, 1, &device, options, NULL, NULL);
  clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, MOST_TEXT, text, NULL);
  if (code != CL_SUCCESS) fprintf(stderr, "%s\n", text);
  check("clBuildProgram", code);
  cl_kernel kernel = clCreateKernel(program, kernel_name, &code);
  check("clCreateKernel", code);
  for (k = 0; k < count; ++k) {
    struct argument* a = &arguments[k];
    if (a->is_buffer) a->memory = clCreateBuffer(context, CL_MEM_READ_WRITE, a->room, NULL, &code);
    check("clCreateBuffer", code);
    CALL(clSetKernelArg, (kernel, (cl_uint)k, a->is_buffer ? sizeof a->memory : a->bytes,
                          a->is_buffer ? (void*)&a->memory : (void*)a->before));
  }
  for (run = 1; !different && (most ? run <= most : run <= 20 || time(NULL) < end); ++run) {
    for (k = 0; k < count; ++k)
      if (arguments[k].is_buffer)
        CALL(clEnqueueWriteBuffer, (queue, arguments[k].memory, CL_TRUE, 0, arguments[k].room,
                                    arguments[k].before, 0, NULL, NULL));
    CALL(clEnqueueNDRangeKernel,
         (queue, kernel, global[1] > 1 ? 2 : 1, NULL, global, local, 0, NULL, NULL));
    CALL(clFinish, (queue));
    for (k = 0; k < count; ++k) {
      struct argument* a = &arguments[k];
      if (!a->is_buffer || a->bytes == 0) continue;
      CALL(clEnqueueReadBuffer, (queue, a->memory, CL_TRUE, 0, a->bytes, a->found, 0, NULL, NULL));
      if (run == 1) memcpy(a->first, a->found, a->bytes);
      sprintf(text, a->expected ? "run %d" : "run %d against run 1", run);
      if (differs(a, a->expected ? a->expected : a->first, text)) different = 1;
    }
  }
  printf(different ? "DIFFERS\n" : "the same bits in %d runs\n", run - 1);
  return different;
}
