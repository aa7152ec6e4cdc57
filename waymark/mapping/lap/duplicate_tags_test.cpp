// Ids in two places, told by the wheels alone: a robot that drives along a wall, and what it is said to see.
#include "waymark/mapping/lap/duplicate_tags.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr int kFrames = 900;
constexpr double kStep_m = 0.02;
constexpr double kSight_m = 1.5;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

CameraModel lens() {
  return CameraModel::make(PinholeRadtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4}, 640,
                           480)
      .value();
}

/// There and back along x, 9 m each way, past a tag every half metre; single poses err by a centimetre.
struct Drive {
  LapInput lap{.camera = lens()};
  std::vector<ObservedFrame> observed{};
  Random random{3};

  Drive() {
    for (int f = 0; f < kFrames; ++f) {
      const SensorTime stamp{std::chrono::milliseconds(66 * f)};
      const double x = kStep_m * (f < kFrames / 2 ? f : kFrames - f);
      lap.odometry.push_back({.stamp = stamp, .odom_T_base = SE2(x, 0, 0)});
      lap.frames.push_back({.stamp = stamp});
      observed.push_back({.stamp = stamp});
    }
    for (int number = 0; number < 18; ++number) {
      const Eigen::Vector2d place(0.5 * number, 1);
      for (int f = 0; f < kFrames; ++f) see(f, tag(number), place);
    }
  }

  double x_of(int frame) const { return lap.odometry[static_cast<std::size_t>(frame)].odom_T_base.x(); }

  /// Where the tag is in sight.
  void see(int frame, const TagId& which, const Eigen::Vector2d& place) {
    const auto f = static_cast<std::size_t>(frame);
    if (std::abs(x_of(frame) - place.x()) > kSight_m) return;
    const Eigen::Vector3d odom_p(place.x() + 0.01 * random.normal(), place.y() + 0.01 * random.normal(), 0.3);
    lap.frames[f].detections.push_back({.tag = which, .corners_px = {}});
    observed[f].tags.push_back(
        {.tag = which, .cam_T_tag = lift(lap.odometry[f].odom_T_base).inverse() * SE3({}, odom_p)});
  }

  /// Observations of a tag from one frame to before another show it elsewhere.
  void move(const TagId& which, int from, int to, const Eigen::Vector2d& by) {
    for (int f = from; f < to; ++f) {
      for (TagPoseObservation& seen : observed[static_cast<std::size_t>(f)].tags) {
        if (seen.tag == which) seen.cam_T_tag = SE3({}, Eigen::Vector3d(by.x(), by.y(), 0)) * seen.cam_T_tag;
      }
    }
  }

  void rename(const TagId& from, const TagId& to) {
    for (std::size_t f = 0; f < observed.size(); ++f) {
      for (TagPoseObservation& seen : observed[f].tags) seen.tag = seen.tag == from ? to : seen.tag;
      for (TagDetection& seen : lap.frames[f].detections) seen.tag = seen.tag == from ? to : seen.tag;
    }
  }

  std::vector<internal::ObservationIndex> second() const {
    return internal::observations_of_duplicate_tags(lap, observed);
  }
  int observations(const TagId& which, int from = 0, int to = kFrames) const {
    int count = 0;
    for (int f = from; f < to; ++f)
      count += static_cast<int>(
          std::ranges::count(lap.frames[static_cast<std::size_t>(f)].detections, which, &TagDetection::tag));
    return count;
  }
};

TEST(DuplicateTags, TagsThatStandHaveNone) {
  EXPECT_TRUE(Drive().second().empty());
  Drive without_wheels;
  without_wheels.lap.odometry.clear();
  EXPECT_TRUE(without_wheels.second().empty());
}

TEST(DuplicateTags, TwoTagsOfOneIdSeenByTurns) {
  Drive drive;
  const int copies = drive.observations(tag(6));
  drive.rename(tag(6), tag(5));  // half a metre on
  const auto second = drive.second();
  EXPECT_NEAR(static_cast<double>(second.size()), copies, 0.05 * copies);
  const LapInput rest = internal::without(drive.lap, second);
  int left = 0;
  for (const TagFrame& frame : rest.frames) {
    const auto here = std::ranges::count(frame.detections, tag(5), &TagDetection::tag);
    EXPECT_LE(here, 1);
    left += static_cast<int>(here);
  }
  EXPECT_EQ(left + static_cast<int>(second.size()), drive.observations(tag(5)));
}

TEST(DuplicateTags, ATagThatIsMovedInView) {
  Drive drive;
  const int moment = 200;  // of 125 to 275, on the way there
  drive.move(tag(8), moment, kFrames, {0.1, 0.08});
  const auto second = drive.second();
  EXPECT_EQ(static_cast<int>(second.size()), drive.observations(tag(8), 0, moment)) << "the lesser part";
  EXPECT_TRUE(std::ranges::all_of(second, [&](const auto& index) { return index.frame < 200; }));
}

TEST(DuplicateTags, WhereEverythingJumpsItWasTheWheels) {
  Drive drive;
  for (int number = 0; number < 18; ++number) drive.move(tag(number), 200, kFrames, {0.25, 0.1});
  EXPECT_TRUE(drive.second().empty());
}

TEST(DuplicateTags, FarApartTheWheelsAreTrustedAsFarAsTheyFindTagsAgain) {
  Drive drive;
  const int fewer = std::min(drive.observations(tag(1)), drive.observations(tag(16)));
  drive.rename(tag(16), tag(1));
  EXPECT_EQ(static_cast<int>(drive.second().size()), fewer);
  Drive slipping;  // on the way back all is elsewhere
  for (int number = 0; number < 18; ++number) slipping.move(tag(number), kFrames / 2 + 80, kFrames, {0, 6});
  EXPECT_LT(slipping.second().size(), 100U);
}

TEST(DuplicateTags, IdsThatAreMisreadLeadNowhere) {
  Drive drive;
  for (std::size_t f = 0; f < drive.observed.size(); ++f) {
    for (std::size_t d = 0; d < drive.observed[f].tags.size(); ++d) {
      if (drive.random.uniform(0, 1) > 0.05) continue;
      const TagId misread = tag(static_cast<int>(drive.random.uniform(0, 17.99)));
      drive.observed[f].tags[d].tag = drive.lap.frames[f].detections[d].tag = misread;
    }
  }
  EXPECT_TRUE(drive.second().empty());
}

}  // namespace
}  // namespace waymark
