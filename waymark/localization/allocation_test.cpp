// Once initialised, the filter must not allocate memory. malloc counts the allocations, because every
// allocation passes through it.
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/support/sanitized.hpp"

#if defined(__GLIBC__) && !defined(WAYMARK_SANITIZED)

#include <cmath>

#include "waymark/geometry/planar.hpp"
#include "waymark/localization/smoother.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

// NOLINTBEGIN(bugprone-reserved-identifier, cert-dcl37-c, cert-dcl51-cpp): glibc's allocator behind malloc
extern "C" void* __libc_malloc(std::size_t size);
namespace {
bool counting = false;
int allocations = 0;
}  // namespace
extern "C" void* malloc(std::size_t size) {
  if (counting) ++allocations;
  return __libc_malloc(size);
}
// NOLINTEND(bugprone-reserved-identifier, cert-dcl37-c, cert-dcl51-cpp)

namespace waymark {
namespace {

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

struct KnownPlace {
  PinholeRadtan lens{.fx = 440, .fy = 440, .cx = 320, .cy = 240, .k = {}, .coefficients = 0};
  MountedSensor sensor{CameraModel::make(lens, 640, 480).value(), SE3(body_R_optical(), {0.08, 0, 0.18})};
  TagMap map{};
  TagFrame frame{};

  KnownPlace() {
    for (int i = 0; i < 9; ++i) {  // more than fit in one update
      const MappedTag tag{.map_T_tag = SE3(body_R_optical(), {2.5, -0.8 + 0.2 * i, 0.3}), .size_m = 0.12};
      map.tags[{.number = i}] = tag;
      const auto corners =
          visible_corners(*sensor.camera, sensor.base_T_sensor.inverse() * tag.map_T_tag, tag.size_m);
      if (corners) frame.detections.push_back({.tag = {.number = i}, .corners_px = *corners});
    }
  }
};

/// Runs until the filter is initialised, and expects no allocations after that.
void expect_none(LocalizationMethod& method, const RiekfLocalizer& filter, KnownPlace place) {
  ASSERT_EQ(place.frame.detections.size(), 9U);
  TagFrame& frame = place.frame;
  const auto run = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      method.add(ImuSample{.stamp = at(10 + 0.02 * i)});
      method.add(Odometry{.stamp = at(10 + 0.02 * i)});
      frame.stamp = at(10 + 0.02 * i - (i % 3 == 0 ? 0.3 : 0.005));  // some frames arrive late
      method.add(frame);
      method.clear_comparisons();
      static_cast<void>(method.estimate());
    }
  };
  run(0, 10);  // from an unknown pose until it is certain
  ASSERT_TRUE(filter.estimate() && filter.estimate()->certain);
  allocations = 0;
  counting = true;
  run(10, 400);
  counting = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(filter.rewinds(), 20);
}

TEST(AllocationOfTheFilter, TheFilterAllocatesNothingWhileItRuns) {
  const KnownPlace place;
  RiekfLocalizer filter(Landmarks(place.map), place.sensor);
  expect_none(filter, filter, place);
}

TEST(AllocationOfTheFilter, TheFixedLagSmootherAllocatesNothingWhileItRuns) {
  const KnownPlace place;
  RiekfOptions options;
  options.lag_s = 0.4;
  FixedLagSmoother smoother(Landmarks(place.map), place.sensor, options);
  expect_none(smoother, *smoother.filter(), place);
  ASSERT_TRUE(smoother.estimate());
}

TEST(AllocationOfTheFilter, TheCounterCountsAnAllocation) {
  allocations = 0;
  void* volatile something = std::malloc(1);
  std::free(something);
  counting = true;
  something = std::malloc(1);
  counting = false;
  std::free(something);
  EXPECT_EQ(allocations, 1);
}

}  // namespace
}  // namespace waymark

#endif
