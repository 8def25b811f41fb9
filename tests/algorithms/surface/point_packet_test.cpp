#include "algorithms/surface/point_packet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "algorithms/surface/triangle_tree.h"
#include "algorithms/surface/vector_math.h"

namespace volsmooth {
namespace {

constexpr std::size_t kPoints = PointPacket::kPoints;

float uniform(std::mt19937& random, float low, float high) {
  return low + (high - low) * static_cast<float>(random() >> 8) * 0x1p-24F;
}

Float3 random_point(std::mt19937& random) {
  return {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
}

/// Points up to 1 away from the origin along each axis, each with the reach `reach`.
PointPacket random_packet(std::mt19937& random, float reach) {
  PointPacket packet;
  for (std::size_t p = 0; p < kPoints; ++p) {
    const Float3 point = random_point(random);
    for (std::size_t axis = 0; axis < 3; ++axis) packet.at[axis][p] = point[axis];
    packet.reach[p] = reach;
  }
  return packet;
}

Float3 point_of(const PointPacket& packet, std::size_t p) {
  return {packet.at[0][p], packet.at[1][p], packet.at[2][p]};
}

/// Of every shape: long, thin down to a line, tiny, a single point.
std::array<Float3, 3> random_triangle(std::mt19937& random) {
  std::array<Float3, 3> corners{random_point(random), random_point(random), random_point(random)};
  const float thin = std::pow(10.0F, uniform(random, -8, 0)), tiny = std::pow(10.0F, uniform(random, -3, 0));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float along = corners[1][axis] - corners[0][axis], across = corners[2][axis] - corners[0][axis];
    corners[1][axis] = corners[0][axis] + tiny * along;
    corners[2][axis] = corners[0][axis] + tiny * (0.3F * along + thin * across);
  }
  return corners;
}

/// Puts every other point of a packet right above the triangle or below it.
void put_above(const std::array<Float3, 3>& corners, std::mt19937& random, PointPacket& packet) {
  const Vector3 a = to_double(corners[0]), b = to_double(corners[1]), c = to_double(corners[2]);
  const Vector3 normal = area_normal({a, b, c});
  if (length(normal) == 0) return;
  for (std::size_t p = 0; p < kPoints; p += 2) {
    const double one = uniform(random, 0, 1), other = uniform(random, 0, 1) * (1 - one);
    const Vector3 above =
        a + one * (b - a) + other * (c - a) + (uniform(random, -1, 1) / length(normal)) * normal;
    for (std::size_t axis = 0; axis < 3; ++axis) packet.at[axis][p] = static_cast<float>(above[axis]);
  }
}

double longest_side(const std::array<Float3, 3>& corners) {
  double longest = 0;
  for (std::size_t c = 0; c < 3; ++c)
    longest = std::max(longest, length(to_double(corners[(c + 1) % 3]) - to_double(corners[c])));
  return longest;
}

class Packets : public testing::TestWithParam<InstructionSet> {};

TEST_P(Packets, AreWithinTheirSlackOfTheDistanceToATriangle) {
  std::mt19937 random(5);
  for (int k = 0; k < 3000; ++k) {
    const auto corners = random_triangle(random);
    Mesh mesh;
    mesh.positions.assign(corners.begin(), corners.end());
    mesh.triangles = {{0, 1, 2}};
    PointPacket packet = random_packet(random, uniform(random, 0, 2));
    put_above(corners, random, packet);
    const PointPacket before = packet;
    PointPacket::Lanes squared;
    float slack = -1;
    std::int32_t within_reach = -1, surely = 0, perhaps = 0;
    triangle_comparison(GetParam())({&packet, &corners, &squared, &slack, &within_reach});

    EXPECT_LE(slack, 1.001e-3 * longest_side(corners));
    for (std::size_t p = 0; p < kPoints; ++p) {
      const double exact = std::sqrt(nearest_point(mesh, 0, to_double(point_of(packet, p))).squared_distance);
      const double error = double{slack} + double{kRounding} * exact;
      EXPECT_NEAR(std::sqrt(double{squared[p]}), exact, error) << k;
      EXPECT_GE(packet.reach[p], std::min(double{before.reach[p]}, exact)) << k;
      EXPECT_LE(packet.reach[p], std::min(double{before.reach[p]}, exact + 3 * error)) << k;
      surely += exact < double{before.reach[p]} ? 1 : 0;
      perhaps += exact < double{before.reach[p]} + 3 * error ? 1 : 0;
    }
    EXPECT_GE(within_reach, surely) << k;
    EXPECT_LE(within_reach, perhaps) << k;
  }
}

TEST_P(Packets, LeaveOutNoBoxWithinReach) {
  std::mt19937 random(6);
  for (int k = 0; k < 1000; ++k) {
    const PointPacket packet = random_packet(random, uniform(random, 0, 1));
    FourBoxes boxes;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t child = 0; child < 4; ++child) {
        boxes.low[axis][child] = uniform(random, -1, 1);
        boxes.high[axis][child] = boxes.low[axis][child] + uniform(random, 0, 0.5F);
      }
    }
    std::array<std::int32_t, 4> within_reach;
    std::array<float, 4> squared;
    box_comparison(GetParam())({&packet, &boxes, &within_reach, &squared});
    for (std::size_t child = 0; child < 4; ++child) {
      std::int32_t surely = 0, perhaps = 0;
      for (std::size_t p = 0; p < kPoints; ++p) {
        double exact = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double x = packet.at[axis][p];
          const double beyond = std::max({boxes.low[axis][child] - x, x - boxes.high[axis][child], 0.0});
          exact += beyond * beyond;
        }
        if (p == kPoints / 2) {
          EXPECT_NEAR(squared[child], exact, 1e-6 * exact);
        }
        surely += std::sqrt(exact) < double{packet.reach[p]} ? 1 : 0;
        perhaps += std::sqrt(exact) < double{packet.reach[p]} * (1 + 2 * double{kRounding}) ? 1 : 0;
      }
      EXPECT_GE(within_reach[child], surely);
      EXPECT_LE(within_reach[child], perhaps);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, Packets, testing::ValuesIn(instruction_sets()));

}  // namespace
}  // namespace volsmooth
