#include "server/chart/need.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "server/chart/atlas.h"
#include "tests/unit/chart/shapes.h"

namespace bakewell::chart {
namespace {

double Budget(const std::vector<ChartNeed>& needs, const std::vector<float>& factors) {
  double sum = 0;
  for (size_t i = 0; i < needs.size(); ++i) sum += needs[i].area * factors[i] * factors[i];
  return sum;
}

TEST(ChartNeed, BudgetIsKeptAndSteepChartsGetMore) {
  const std::vector<ChartNeed> needs{{4, 0}, {1, 0.1}, {2, 1}, {1, 9}};
  const std::vector<float> factors = DensityFactors(needs);
  EXPECT_NEAR(Budget(needs, factors), 8, 1e-4);  // floats
  EXPECT_LT(factors[0], factors[1]);
  EXPECT_LT(factors[1], factors[2]);
  EXPECT_LT(factors[2], factors[3]);
  // Between the limits f^2 is proportional to the gradient.
  EXPECT_NEAR(factors[3] * factors[3] / (factors[2] * factors[2]), 9, 1e-3);
}

TEST(ChartNeed, FlatSignalChangesNothing) {
  const std::vector<ChartNeed> needs{{4, 0}, {1, 0}};
  EXPECT_EQ(DensityFactors(needs), (std::vector<float>{1, 1}));
}

// Sixteen square plates in a row; plate i carries a shadow edge tanh(k_i x) of its own sharpness k_i.
constexpr int kPlates = 16;
double Sharpness(int plate) { return plate % 4 == 0 ? 20.0 : plate % 4 == 1 ? 3.0 : 0.2; }
double Signal(int plate, double x) { return std::tanh(Sharpness(plate) * (x - 0.5)); }
double SignalSlope(int plate, double x) {
  const double t = Signal(plate, x);
  return Sharpness(plate) * (1 - t * t);
}

Soup Plates() {
  Soup soup;
  for (uint32_t i = 0; i < kPlates; ++i) {
    const float z = static_cast<float>(i);
    soup.position.insert(soup.position.end(), {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}});
    soup.index.insert(soup.index.end(), {4 * i, 4 * i + 1, 4 * i + 2, 4 * i, 4 * i + 2, 4 * i + 3});
  }
  return soup;
}

// Mean squared error of a lightmap whose texels hold the signal at their centres: the plates' real texel sizes.
double MeanSquaredError(const Atlas& atlas) {
  double sum = 0;
  const Mesh& mesh = atlas.meshes[0];
  for (uint32_t plate = 0; plate < kPlates; ++plate) {
    const Vertex &a = mesh.vertexArray[mesh.indexArray[6 * plate]],
                 &b = mesh.vertexArray[mesh.indexArray[6 * plate + 1]];
    const double texels = std::hypot(b.uv[0] - a.uv[0], b.uv[1] - a.uv[1]);
    const int samples = 20000;
    for (int s = 0; s < samples; ++s) {
      const double x = (s + 0.5) / samples, centre = (std::floor(x * texels) + 0.5) / texels;
      sum += std::pow(Signal(static_cast<int>(plate), x) - Signal(static_cast<int>(plate), centre), 2) / samples;
    }
  }
  return sum / kPlates;
}

TEST(ChartNeed, SignalDrivenDensityErrsLessOnTheSamePage) {
  const Soup soup = Plates();
  const MeshDecl decl = soup.Decl();
  auto charts = ComputeCharts(std::span(&decl, 1), {});
  ASSERT_TRUE(charts.ok());
  ASSERT_EQ((*charts)[0].charts.size(), size_t{kPlates});
  const PackOptions page{.resolution = 256};
  const auto uniform = PackCharts(std::span(&decl, 1), *charts, page);
  ASSERT_TRUE(uniform.ok());

  std::vector<ChartNeed> needs(kPlates);
  for (int i = 0; i < kPlates; ++i) {
    double square = 0;
    for (int s = 0; s < 1000; ++s) square += std::pow(SignalSlope(i, (s + 0.5) / 1000), 2) / 1000;
    needs[i] = {1, std::sqrt(square)};
  }
  (*charts)[0].density = DensityFactors(needs);
  const auto driven = PackCharts(std::span(&decl, 1), *charts, page);
  ASSERT_TRUE(driven.ok());
  EXPECT_EQ(driven->width * driven->height, uniform->width * uniform->height);
  // Theory: the least sum is (sum g)^2 / sum 1 against sum g^2, here 0.45; the rest is for whole texels and packing.
  EXPECT_LT(MeanSquaredError(*driven), 0.6 * MeanSquaredError(*uniform));
}

}  // namespace
}  // namespace bakewell::chart
