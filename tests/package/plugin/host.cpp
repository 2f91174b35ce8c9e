// A program that knows nothing of Meniscus but the plug-in's function.
#include <vector>

int pixels_with_surface(const float* x, const float* y, const float* z, int count);

int main() {
  std::vector<float> x, y, z;
  for (int k = 0; k < 512; ++k) {
    x.push_back(static_cast<float>(k % 8));
    y.push_back(static_cast<float>(k / 8 % 8));
    z.push_back(static_cast<float>(k / 64));
  }
  return pixels_with_surface(x.data(), y.data(), z.data(), 512) > 0 ? 0 : 1;
}
