// What a device computes of single values, against the host, which is built without contraction.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "verify/arithmetic.hpp"
#include "verify/bits.hpp"
#include "verify/probe.hpp"

namespace meniscus::verify {
namespace {

constexpr std::size_t kValues = 2048;  // a multiple of 64 work-items of eight

struct Operands {
  std::uint32_t bits[3] = {0, 0, 0};
  float a() const { return float_of(bits[0]); }
  float b() const { return float_of(bits[1]); }
  float c() const { return float_of(bits[2]); }
  std::int32_t x() const { return static_cast<std::int32_t>(bits[0]); }
  std::int32_t y() const { return static_cast<std::int32_t>(bits[1]); }
  std::int32_t z() const { return static_cast<std::int32_t>(bits[2]); }
};

// --- Operands ------------------------------------------------------------------------------------

enum class Kind {
  normal,     // neither they nor their sums and products are denormal, infinite or NaN
  denormal,   // some are, and sums and products of them
  special,    // infinities, zeros of both signs, NaN, the largest
  numbers,    // the same without NaN
  fractions,  // within what an int holds, many near whole numbers and halves
  falling,    // from -100 to 0, for exponentials
  unit,       // about [0, 1]
  integers,
};
constexpr int kKinds = 8;

float drawn(std::mt19937& random, int least_exponent, int greatest_exponent) {
  const auto span = static_cast<std::uint32_t>(greatest_exponent - least_exponent + 1);
  const int exponent = least_exponent + static_cast<int>(random() % span);
  const float mantissa = 1 + static_cast<float>(random() >> 9) * 0x1p-23f;
  return std::ldexp(random() & 1 ? -mantissa : mantissa, exponent);
}

std::vector<float> edges(Kind kind) {
  constexpr float kInf = INFINITY, kMax = 0x1.fffffep127f, kTiny = 0x1p-149f;
  switch (kind) {
    case Kind::normal:
      return {1, -1, 2, -0.5f, 3, 1 / 3.0f, 0x1.000002p0f, 0x1.fffffep0f, 0x1p20f, -0x1p-20f, 10};
    case Kind::denormal:
      return {kTiny, -kTiny, 0x1p-126f, 0x1.fffffcp-127f, 0x1p-140f, -0x1p-130f, 1, 0};
    case Kind::special:
    case Kind::numbers: {
      std::vector<float> values{0.0f, -0.0f, 1, -1, kInf, -kInf, kMax, -kMax, 3, 0x1p100f};
      if (kind == Kind::special) values.push_back(NAN);
      return values;
    }
    case Kind::fractions:
      return {0.0f,     -0.0f,      0.5f,           -0.5f,           1,          -1,
              1.5f,     -1.5f,      0x1.fffffep-1f, -0x1.fffffep-1f, 8388607.5f, -8388607.5f,
              16777216, 2147483520, -2147483648.0f, 1e-20f,          -1e-20f};
    case Kind::falling:
      return {0.0f, -0.0f, -87, -87.00001f, -86.99999f, -88, -100, -1e-20f, -0.6931472f, -1};
    case Kind::unit:
      return {0, 1, 0.2f, 0.7f, 0.5f, -1, 2};
    case Kind::integers:
      break;
  }
  return {};
}

float drawn_of(Kind kind, std::mt19937& random) {
  switch (kind) {
    case Kind::denormal:
      // Half of them denormal, the others near what makes the product of both denormal.
      return random() & 1 ? std::copysign(float_of(static_cast<std::uint32_t>(random() >> 9)),
                                          random() & 1 ? -1.0f : 1.0f)
                          : drawn(random, -80, -50);
    case Kind::fractions:
      return drawn(random, -3, 30);
    case Kind::falling:
      return -100 * static_cast<float>(random() >> 8) * 0x1p-24f;
    case Kind::unit:
      return static_cast<float>(random() >> 8) * 0x1.8p-24f - 0.25f;
    default:
      return drawn(random, -20, 20);
  }
}

std::uint32_t integer_of(std::mt19937& random) {
  constexpr std::uint32_t kEdges[] = {0, 1, 0xffffffff, 0x7fffffff, 0x80000000, 31, 0x01000001};
  const std::uint32_t choice = random() % 16;
  if (choice < 4) return kEdges[random() % std::size(kEdges)];
  return choice < 8 ? random() % 1000 : static_cast<std::uint32_t>(random());
}

// Every pair of edges first, as many as there is room for; then seeded numbers.
std::vector<Operands> operands_of(Kind kind) {
  std::mt19937 random(static_cast<unsigned>(kind) + 1);
  const std::vector<float> edge = edges(kind);
  std::vector<Operands> all(kValues);
  for (std::size_t i = 0; i < kValues; ++i) {
    for (std::uint32_t& bits : all[i].bits)
      bits = kind == Kind::integers ? integer_of(random) : bits_of(drawn_of(kind, random));
    if (i >= edge.size() * edge.size()) continue;
    all[i].bits[0] = bits_of(edge[i / edge.size()]);
    all[i].bits[1] = bits_of(edge[i % edge.size()]);
    all[i].bits[2] = bits_of(edge[(i / 3 + i) % edge.size()]);
  }
  return all;
}

// --- What is expected ----------------------------------------------------------------------------

/// What rests on a probe's answer.
enum class Need {
  same_bits,
  nothing,
  no_call,  // ... and no kernel of ours calls the function
};

using Host = std::uint32_t (*)(const Operands&);

/// What a probe asks, or tells where the built-in function is left to the device.
struct Expression {
  const char* name;  // in capitals in arithmetic.cl
  Kind kind;
  Reading reading;
  const char* section;
  Need need;
  Host expected;                               // the same bits
  const char* suspicion = "";                  // what a device may do instead
  Host suspected = nullptr;                    // ... and what it would find then
  double (*exact)(const Operands&) = nullptr;  // instead of `expected`: within `allowed` ulp
  double allowed = 0;
};

// The steps of prelude.cl.
float exp_negative(float x) {
  const float y = std::fmax(x, -87.0f) * 1.44269504f;
  const int whole = static_cast<int>(y - 0.5f);
  const float f = (y - static_cast<float>(whole)) * 0.693147181f;
  float p = 1.0f / 5040.0f;
  for (const float c : {1.0f / 720.0f, 1.0f / 120.0f, 1.0f / 24.0f, 1.0f / 6.0f, 0.5f, 1.0f, 1.0f})
    p = std::fma(p, f, c);
  return x < -87.0f ? 0.0f : p * float_of(static_cast<std::uint32_t>(whole + 127) << 23);
}

float smooth_step_of(float low, float high, float x) {
  const float t = std::fmin(std::fmax((x - low) * (1.0f / (high - low)), 0.0f), 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

float flushed(float x) { return std::fpclassify(x) == FP_SUBNORMAL ? std::copysign(0.0f, x) : x; }

std::uint32_t bits_of_tests(std::initializer_list<bool> tests) {
  std::uint32_t bits = 0, bit = 1;
  for (const bool test : tests) {
    bits |= test ? bit : 0;
    bit *= 2;
  }
  return bits;
}

std::uint32_t compared(const Operands& o) {
  const float a = o.a(), b = o.b();
  return bits_of_tests({a<b, a <= b, a> b, a >= b, a == b, a != b, a < INFINITY});
}

std::uint32_t compared_denormals(float a, float b) { return bits_of_tests({a<b, a == b, a> 0}); }

#define FLOAT(expression)                                         \
  [](const Operands& o) -> std::uint32_t {                        \
    [[maybe_unused]] const float a = o.a(), b = o.b(), c = o.c(); \
    return bits_of(static_cast<float>(expression));               \
  }
#define INTEGER(expression)                                                              \
  [](const Operands& o) -> std::uint32_t {                                               \
    [[maybe_unused]] const std::int32_t x = o.x(), y = o.y(), z = o.z();                 \
    [[maybe_unused]] const std::uint32_t ux = o.bits[0], uy = o.bits[1], uz = o.bits[2]; \
    [[maybe_unused]] const float a = o.a();                                              \
    return static_cast<std::uint32_t>(expression);                                       \
  }
#define EXACT(expression)                                          \
  [](const Operands& o) -> double {                                \
    [[maybe_unused]] const double a = o.a(), b = o.b(), c = o.c(); \
    return expression;                                             \
  }

constexpr const char* kAccuracy = "OpenCL C 1.2, 7.4";
constexpr const char* kRounding = "OpenCL C 1.2, 7.4 and API 5.6.4.2";
constexpr const char* kContract = "OpenCL C 1.2, 6.12.2.1 (FP_CONTRACT)";
constexpr const char* kOptimize = "OpenCL API 1.2, 5.6.4.3 (nothing is reassociated unasked)";
constexpr const char* kDenormal = "OpenCL C 1.2, 7.2 and 7.5.3; API table 4.3 (CL_FP_DENORM)";
constexpr const char* kInfinity = "OpenCL C 1.2, 7.2 and 7.5";
constexpr const char* kMaths = "OpenCL C 1.2, 6.12.2";
constexpr const char* kConvert = "OpenCL C 1.2, 6.2.3";
constexpr const char* kOperators = "OpenCL C 1.2, 6.3";

const Expression kExpressions[] = {
    {"sum", Kind::normal, Reading::floats, kAccuracy, Need::same_bits, FLOAT(a + b)},
    {"difference", Kind::normal, Reading::floats, kAccuracy, Need::same_bits, FLOAT(a - b)},
    {"product", Kind::normal, Reading::floats, kAccuracy, Need::same_bits, FLOAT(a* b)},
    {"quotient", Kind::normal, Reading::floats, kRounding, Need::same_bits, FLOAT(a / b),
     "a times a reciprocal", FLOAT(a*(1.0f / b))},
    {"reciprocal", Kind::normal, Reading::floats, kRounding, Need::same_bits, FLOAT(1.0f / a)},
    {"square_root", Kind::normal, Reading::floats, kRounding, Need::same_bits,
     FLOAT(std::sqrt(std::fabs(a)))},
    {"fused", Kind::normal, Reading::floats, kMaths, Need::same_bits, FLOAT(std::fma(a, b, c)),
     "rounded twice", FLOAT(a* b + c)},
    {"product_and_sum", Kind::normal, Reading::floats, kContract, Need::same_bits, FLOAT(a* b + c),
     "contracted to fma", FLOAT(std::fma(a, b, c))},
    {"product_and_difference", Kind::normal, Reading::floats, kContract, Need::same_bits,
     FLOAT(c - a * b), "contracted to fma", FLOAT(std::fma(-a, b, c))},
    {"sum_of_products", Kind::normal, Reading::floats, kContract, Need::same_bits,
     FLOAT(a* b + b * c + c * a), "contracted to fma", FLOAT(std::fma(c, a, std::fma(b, c, a* b)))},
    {"sum_of_three", Kind::normal, Reading::floats, kOptimize, Need::same_bits, FLOAT(a + (b + c)),
     "in another order", FLOAT(a + b + c)},
    {"sum_taken_back", Kind::normal, Reading::floats, kOptimize, Need::same_bits,
     FLOAT((a + b) - a), "simplified", FLOAT(b)},
    {"product_taken_back", Kind::normal, Reading::floats, kOptimize, Need::same_bits,
     FLOAT(a* b / b), "simplified", FLOAT(a)},
    {"common_factor", Kind::normal, Reading::floats, kOptimize, Need::same_bits,
     FLOAT(a* b + a * c), "the factor taken out", FLOAT(a*(b + c))},
    {"infinite_sum", Kind::special, Reading::floats, kInfinity, Need::same_bits, FLOAT(a + b)},
    {"infinite_product", Kind::special, Reading::floats, kInfinity, Need::same_bits, FLOAT(a* b)},
    {"infinite_quotient", Kind::special, Reading::floats, kInfinity, Need::same_bits, FLOAT(a / b)},
    {"comparison", Kind::special, Reading::integers, kOperators, Need::same_bits, compared},
    {"negation", Kind::special, Reading::integers, kOperators, Need::same_bits,
     [](const Operands& o) {
       return bits_of_tests({!(o.a() < o.b()), o.a() < o.b() && !(o.b() < o.c())});
     }},
    {"least", Kind::special, Reading::unsigned_zeros, kMaths, Need::same_bits,
     FLOAT(std::fmin(a, b)), "the other of NaN", FLOAT(b < a ? b : a)},
    {"greatest", Kind::special, Reading::unsigned_zeros, kMaths, Need::same_bits,
     FLOAT(std::fmax(a, b)), "the other of NaN", FLOAT(b > a ? b : a)},
    {"clamped", Kind::numbers, Reading::unsigned_zeros, "OpenCL C 1.2, 6.12.4", Need::same_bits,
     FLOAT(std::fmin(std::fmax(a, std::fmin(b, c)), std::fmax(b, c)))},
    {"selected", Kind::special, Reading::floats, "OpenCL C 1.2, 6.12.6", Need::same_bits,
     FLOAT(a < c ? b : a)},
    {"absolute", Kind::special, Reading::floats, kMaths, Need::same_bits, FLOAT(std::fabs(a))},
    {"negated", Kind::special, Reading::floats, kOperators, Need::same_bits, FLOAT(-a)},
    {"rounded_down", Kind::fractions, Reading::floats, kMaths, Need::same_bits,
     FLOAT(std::floor(a))},
    {"rounded_up", Kind::fractions, Reading::floats, kMaths, Need::same_bits, FLOAT(std::ceil(a))},
    {"float_to_int", Kind::fractions, Reading::integers, kConvert, Need::same_bits,
     INTEGER(static_cast<std::int32_t>(a))},
    {"floor_to_int", Kind::fractions, Reading::integers, kConvert, Need::same_bits,
     INTEGER(static_cast<std::int32_t>(std::floor(a)))},
    {"int_to_float", Kind::integers, Reading::floats, kConvert, Need::same_bits,
     [](const Operands& o) { return bits_of(static_cast<float>(o.x())); }},
    {"exp_negative", Kind::falling, Reading::floats, "", Need::same_bits, FLOAT(exp_negative(a))},
    {"smooth_step", Kind::unit, Reading::floats, "", Need::same_bits,
     FLOAT(smooth_step_of(0.2f, 0.7f, a))},
    {"uint_wraps", Kind::integers, Reading::integers, kOperators, Need::same_bits,
     INTEGER(ux* uy + uz)},
    {"int_quotient", Kind::integers, Reading::integers, kOperators, Need::same_bits,
     INTEGER((x / ((y & 0xffff) + 1)) ^ (x % ((z & 0xff) + 1)))},
    {"shifts", Kind::integers, Reading::integers, kOperators, Need::same_bits,
     INTEGER((ux << (uy & 31)) ^ static_cast<std::uint32_t>(x >> (uz & 31)) ^ (ux >> (uy & 31)))},
    {"int_bounds", Kind::integers, Reading::integers, "OpenCL C 1.2, 6.12.3", Need::same_bits,
     INTEGER(std::min(std::max(x, y), z))},
    {"bitwise", Kind::integers, Reading::integers, kOperators, Need::same_bits,
     INTEGER((ux & uy) | (~uz ^ ux))},
    {"selected_bits", Kind::integers, Reading::floats, "OpenCL C 1.2, 6.2.4.2 and 6.12.6",
     Need::same_bits, INTEGER(x < z ? uy : ux)},
    // What may explain a difference, but what no kernel of ours rests on.
    {"denormal_sum", Kind::denormal, Reading::floats, kDenormal, Need::nothing, FLOAT(a + b),
     "flushed to zero", FLOAT(flushed(flushed(a) + flushed(b)))},
    {"denormal_product", Kind::denormal, Reading::floats, kDenormal, Need::nothing, FLOAT(a* b),
     "flushed to zero", FLOAT(flushed(flushed(a) * flushed(b)))},
    {"denormal_comparison", Kind::denormal, Reading::integers, kDenormal, Need::nothing,
     [](const Operands& o) { return compared_denormals(o.a(), o.b()); }, "flushed to zero",
     [](const Operands& o) { return compared_denormals(flushed(o.a()), flushed(o.b())); }},
    {"convert_int_rtn", Kind::fractions, Reading::integers, "OpenCL C 1.2, 6.2.3.2", Need::no_call,
     INTEGER(static_cast<std::int32_t>(std::floor(a))), "truncated",
     INTEGER(static_cast<std::int32_t>(a))},
    {"mul24", Kind::integers, Reading::integers, "OpenCL C 1.2, 6.12.3", Need::no_call,
     INTEGER(static_cast<std::uint32_t>(x >> 8) * static_cast<std::uint32_t>(y >> 8))},
    {"popcount", Kind::integers, Reading::integers, "OpenCL C 1.2, 6.12.3", Need::no_call,
     INTEGER(std::popcount(ux))},
    {"clz", Kind::integers, Reading::integers, "OpenCL C 1.2, 6.12.3", Need::no_call,
     INTEGER(std::countl_zero(ux))},
    {"mad", Kind::normal, Reading::floats, kMaths, Need::no_call, nullptr, "fused",
     FLOAT(std::fma(a, b, c)), EXACT(a* b + c), INFINITY},
    {"exp", Kind::falling, Reading::floats, kAccuracy, Need::no_call, nullptr, "", nullptr,
     EXACT(std::exp(a)), 3},
    {"exp2", Kind::falling, Reading::floats, kAccuracy, Need::no_call, nullptr, "", nullptr,
     EXACT(std::exp2(a)), 3},
    {"rsqrt", Kind::normal, Reading::floats, kAccuracy, Need::no_call, nullptr, "", nullptr,
     EXACT(1 / std::sqrt(std::fabs(a))), 2},
    {"native_exp", Kind::falling, Reading::floats, kMaths, Need::no_call, nullptr, "", nullptr,
     EXACT(std::exp(a)), INFINITY},
    {"native_rsqrt", Kind::normal, Reading::floats, kMaths, Need::no_call, nullptr, "", nullptr,
     EXACT(1 / std::sqrt(std::fabs(a))), INFINITY},
    {"native_recip", Kind::normal, Reading::floats, kMaths, Need::no_call, nullptr, "", nullptr,
     EXACT(1 / a), INFINITY},
};

#undef FLOAT
#undef INTEGER
#undef EXACT

// --- Probing -------------------------------------------------------------------------------------

// Two programs, so that a compiler without some built-in function that no kernel of ours calls
// still answers what they rest on.
std::string program_options(const Expression& expression) {
  const bool built_in = expression.need == Need::no_call;
  std::string options = built_in ? " -D PROBE_BUILT_IN" : " -D PROBE_EXPRESSIONS";
  int number = 0;
  for (const Expression& each : kExpressions) {
    std::string name;
    for (const char* c = each.name; *c; ++c)
      name += static_cast<char>(std::toupper(static_cast<unsigned char>(*c)));
    if ((each.need == Need::no_call) == built_in)
      options += " -D PROBE_" + name + "=" + std::to_string(number);
    ++number;
  }
  return options;
}

std::vector<std::uint32_t> computed(Device& device, const Expression& expression, int width,
                                    const std::vector<Operands>& operands) {
  std::vector<std::uint32_t> column[3];
  for (const Operands& o : operands)
    for (int k = 0; k < 3; ++k) column[k].push_back(o.bits[k]);
  const auto x = upload(device, column[0]), y = upload(device, column[1]),
             z = upload(device, column[2]);
  const auto result = filled<std::uint32_t>(device, operands.size(), 0xdeadbeefu);
  launch(device, "arithmetic.cl", "compute_values",
         {operands.size() / static_cast<std::size_t>(width)},
         width_option(width) + program_options(expression), x, y, z, result,
         static_cast<cl_int>(&expression - kExpressions));
  return download(device, result);
}

std::string words(const Operands& o, Reading reading) {
  std::string text;
  for (int k = 0; k < 3; ++k)
    text += std::string(k ? ", " : "") + "abc"[k] + " = " + hex(o.bits[k], reading);
  return text;
}

// The error of a function that is left to the device.
Finding error_of(const Expression& expression, const std::vector<Operands>& operands,
                 const std::vector<std::uint32_t>& found) {
  double worst = 0;
  std::size_t other = 0, at = 0, suspect = 0;
  for (std::size_t i = 0; i < operands.size(); ++i) {
    const double exact = expression.exact(operands[i]);
    // What is denormal may be flushed.
    if (std::abs(exact) < 0x1p-125) continue;
    const double error = std::abs(float_of(found[i]) - exact) / ulp_of(exact);
    if (!(error <= worst)) worst = std::isnan(error) ? INFINITY : error, at = i;
    other += found[i] != bits_of(static_cast<float>(exact));
    suspect += expression.suspected && found[i] == expression.suspected(operands[i]);
  }
  std::string reason = "all correctly rounded";
  if (other > 0)
    reason =
        std::to_string(other) + " of " + std::to_string(operands.size()) + " not correctly rounded";
  if (suspect == operands.size()) reason += std::string("; ") + expression.suspicion;
  if (worst <= expression.allowed) return {Result::pass, reason, worst};
  return failed(reason + "; worst at " + words(operands[at], Reading::floats) + ": found " +
                    hex(found[at], Reading::floats),
                worst);
}

Finding bits_as_expected(const Expression& expression, const std::vector<Operands>& operands,
                         const std::vector<std::uint32_t>& found) {
  std::vector<std::uint32_t> expected, suspected;
  for (const Operands& o : operands) {
    expected.push_back(expression.expected(o));
    if (expression.suspected) suspected.push_back(expression.suspected(o));
  }
  const bool floats = expression.reading != Reading::integers;
  const Difference difference = compare(expected, found, expression.reading);
  if (difference.count == 0) return {Result::pass, "", floats ? 0.0 : -1};
  const std::size_t i = difference.first;
  const bool integers = expression.kind == Kind::integers;
  std::string reason = std::to_string(difference.count);
  reason += " of " + std::to_string(difference.of) + " differ, first at " +
            words(operands[i], integers ? Reading::integers : Reading::floats) + ": expected " +
            hex(expected[i], expression.reading) + ", found " + hex(found[i], expression.reading);
  if (!suspected.empty() && compare(suspected, found, expression.reading).count == 0)
    reason += std::string("; all as if ") + expression.suspicion;
  return failed(reason, floats ? difference.ulp : -1);
}

// Rounding is known to be correct only where the option for it is offered (API, table 4.3).
std::string rounding_option(Device& device) {
  const auto config = handle_of(device.info()).getInfo<CL_DEVICE_SINGLE_FP_CONFIG>();
  return config & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT
             ? "with -cl-fp32-correctly-rounded-divide-sqrt"
             : "-cl-fp32-correctly-rounded-divide-sqrt is not offered";
}

bool is_denormal(std::uint32_t bits) { return std::fpclassify(float_of(bits)) == FP_SUBNORMAL; }

}  // namespace

void probe_expressions(Device& device, const Report& report) {
  std::array<std::vector<Operands>, kKinds> drawn;
  for (int k = 0; k < kKinds; ++k) drawn[k] = operands_of(static_cast<Kind>(k));
  for (const Expression& expression : kExpressions) {
    std::vector<Operands> operands = drawn[static_cast<int>(expression.kind)];
    // Denormal results are asked for apart, so that one cause does not hide another.
    if (expression.expected && expression.reading != Reading::integers &&
        expression.kind != Kind::denormal)
      for (Operands& o : operands)
        if (is_denormal(expression.expected(o))) o = operands.back();
    for (const int width : {1, 8}) {
      report_probe(
          {.group = "probe",
           .kernel = expression.name,
           .variant = "width " + std::to_string(width),
           .size = std::to_string(kValues) + " values",
           .required = expression.need == Need::same_bits,
           .section = expression.section},
          [&] {
            const auto found = computed(device, expression, width, operands);
            Finding finding = expression.exact ? error_of(expression, operands, found)
                                               : bits_as_expected(expression, operands, found);
            if (expression.section == kRounding)
              finding.reason += (finding.reason.empty() ? "" : "; ") + rounding_option(device);
            return finding;
          },
          report);
    }
  }
}

}  // namespace meniscus::verify
