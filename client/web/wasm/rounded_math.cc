// The functions of <cmath> that the masks of Loop's scheme take, rounded from quadruple precision
// (long double here). The C library of WebAssembly errs by up to an ulp where the GNU one
// practically never does, and a surface is to have the same bits in the browser as everywhere else.
extern "C" {
long double cosl(long double);
long double sinl(long double);
long double sqrtl(long double);
long double scalbnl(long double, int);
double log(double);
}

namespace {

constexpr long double kLn2 = 0.693147180559945309417232121458176568L;

// The C library's own quadruple exp and acosh are those of double. Taylor's series on
// |x| <= ln 2 / 2: the 28th term is below 1e-43.
long double QuadrupleExp(long double x) {
  const int exponent = static_cast<int>(x / kLn2 + (x < 0 ? -0.5L : 0.5L));
  const long double rest = x - exponent * kLn2;
  long double sum = 1;
  for (int n = 28; n > 0; --n) sum = 1 + sum * rest / n;
  return scalbnl(sum, exponent);
}

// Newton's steps from the logarithm in double: each doubles the digits.
long double QuadrupleLog(long double x) {
  long double result = log(static_cast<double>(x));
  for (int step = 0; step < 2; ++step) result += x / QuadrupleExp(result) - 1;
  return result;
}

}  // namespace

extern "C" {
double cos(double x) { return static_cast<double>(cosl(x)); }
double sin(double x) { return static_cast<double>(sinl(x)); }

double exp(double x) {
  if (!(x > -745.2)) return x != x ? x : 0;
  if (x > 709.8) return __builtin_inf();
  return static_cast<double>(QuadrupleExp(x));
}

double acosh(double x) {
  if (!(x >= 1 && x < 1e300)) return x == __builtin_inf() ? x : __builtin_nan("");
  const long double y = x;
  return static_cast<double>(QuadrupleLog(y + sqrtl(y * y - 1)));
}
}
