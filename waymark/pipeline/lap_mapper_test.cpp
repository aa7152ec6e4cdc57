#include "waymark/pipeline/lap_mapper.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr TagId kAnchor{FamilyId::Tag36h11, 0};
constexpr TagId kOther{FamilyId::Tag36h11, 1};

SE3 base_T_cam() {
  return {SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()), {0.1, 0, 0.2}};
}

TeachSetup some_setup() {
  return {.camera =
              CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value(),
          .base_T_cam = base_T_cam(),
          .sizes = {.default_size_m = 0.16},
          .anchor = kAnchor,
          // An upright tag that faces in the direction of smaller x.
          .map_T_anchor = SE3(base_T_cam().rotation(), {4, 0.4, 0.3})};
}

/// A drive of one metre straight ahead; both tags are visible in each of the 20 frames.
TaughtLap some_lap(const TeachSetup& setup) {
  TagMap tags;
  tags.tags[kAnchor] = {.map_T_tag = setup.map_T_anchor, .size_m = 0.16};
  tags.tags[kOther] = {
      .map_T_tag = SE3(SO3::from_rpy(0, 0, 0.5) * base_T_cam().rotation(), {3.6, -0.5, 0.35}),
      .size_m = 0.16};
  TaughtLap lap;
  for (int i = 0; i <= 20; ++i) {
    TagFrame frame{.stamp = SensorTime(std::chrono::milliseconds(100 * i))};
    const SE3 map_T_cam = SE3(SO3(), {1 + 0.05 * i, 0, 0}) * setup.base_T_cam;
    for (const auto& [id, tag] : tags.tags) {
      const auto corners = visible_corners(setup.camera, map_T_cam.inverse() * tag.map_T_tag, tag.size_m);
      if (!corners) continue;
      frame.detections.push_back({.tag = id, .decision_margin = 80, .corners_px = *corners});
      frame.detections.back().corner_covariance_px2 = CornerCovariance::Identity() * 0.01;
    }
    lap.frames.push_back(frame);
  }
  return lap;
}

TEST(LapMapper, AnExactLapGivesAnExactMap) {
  const TeachSetup setup = some_setup();
  const auto lap = map_lap(some_lap(setup), setup);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_EQ(lap->map.tags.size(), 2U);
  EXPECT_EQ(lap->frames, 21);
  EXPECT_EQ(lap->frames_without_pose, 0);
  EXPECT_EQ(lap->observations.at(kAnchor), 21);
  ASSERT_NE(lap->map.find(kOther), nullptr);
  EXPECT_LT((lap->map.find(kOther)->map_T_tag.translation() - Eigen::Vector3d(3.6, -0.5, 0.35)).norm(), 1e-3);
  EXPECT_NEAR(lap->route.length_m, 1.0, 0.06);
  EXPECT_FALSE(lap->route.closed);
  ASSERT_FALSE(lap->warnings.empty());
  testing::expect_on_page("map", lap->warnings.back());
}

TEST(LapMapper, RefusesAMapOfASingleTag) {
  const TeachSetup setup = some_setup();
  TaughtLap alone = some_lap(setup);
  TaughtLap apart = alone;
  for (TagFrame& frame : alone.frames)
    std::erase_if(frame.detections, [](const TagDetection& seen) { return seen.tag != kAnchor; });
  for (std::size_t f = 0; f < apart.frames.size(); ++f)
    std::erase_if(apart.frames[f].detections,
                  [&](const TagDetection& seen) { return (seen.tag == kAnchor) != (f % 2 == 0); });
  for (const MapMethod method : {MapMethod::Bundle, MapMethod::Chain}) {
    for (const TaughtLap& lap : {alone, apart}) {
      const auto map = map_lap(lap, setup, {.method = method});
      ASSERT_FALSE(map);
      EXPECT_EQ(map.error().code, ErrorCode::NotFound);
      EXPECT_FALSE(map.error().hint.empty());
      testing::expect_on_page("map", map.error());
    }
  }
}

TEST(LapMapper, MappingInPlaceGivesTheSamplesBack) {
  const TeachSetup setup = some_setup();
  TaughtLap taught = some_lap(setup);
  const auto copied = map_lap(taught, setup);
  ASSERT_TRUE(copied) << to_string(copied.error());
  const TagFrame* frames = taught.frames.data();
  const TagDetection* detections = taught.frames.back().detections.data();
  TeachSetup elsewhere = setup;
  elsewhere.anchor = {FamilyId::Tag36h11, 7};
  EXPECT_FALSE(map_lap_in_place(taught, elsewhere));
  for (const MapMethod method : {MapMethod::Bundle, MapMethod::Chain}) {
    const auto lap = map_lap_in_place(taught, setup, {.method = method});
    ASSERT_TRUE(lap) << to_string(lap.error());
    EXPECT_EQ(lap->observations, copied->observations);
    ASSERT_EQ(taught.frames.size(), 21U);
    EXPECT_EQ(taught.frames.data(), frames);
    EXPECT_EQ(taught.frames.back().detections.data(), detections);
    if (method == MapMethod::Chain) continue;
    for (const auto& [id, tag] : copied->map.tags)
      EXPECT_EQ(lap->map.tags.at(id).map_T_tag.translation(), tag.map_T_tag.translation());
  }
}

TEST(LapMapper, ParsesTheNamesOfMethods) {
  for (const std::string& name : map_methods()) EXPECT_EQ(to_string(parse_map_method(name).value()), name);
  const auto unknown = parse_map_method("chian");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().place.key, "method");
  testing::expect_on_page("map", unknown.error());
}

TEST(LapMapper, ReportsMissingInput) {
  const TeachSetup setup = some_setup();
  const auto error_of = [&](const TaughtLap& frames, const TeachSetup& with,
                            const MapLapOptions& options = {}) {
    const auto lap = map_lap(frames, with, options);
    EXPECT_FALSE(lap);
    return lap ? Error{} : lap.error();
  };
  const Error empty = error_of({}, setup);
  EXPECT_EQ(empty.code, ErrorCode::NotFound);
  testing::expect_on_page("map", empty);
  TeachSetup elsewhere = setup;
  elsewhere.anchor = {FamilyId::Tag36h11, 7};
  const Error without_anchor = error_of(some_lap(setup), elsewhere);
  EXPECT_THAT(without_anchor.message, ::testing::HasSubstr("tag36h11:7"));
  testing::expect_on_page("map", without_anchor);
  const TaughtLap standing{.frames = std::vector<TagFrame>(5, some_lap(setup).frames.front())};
  const Error too_short = error_of(standing, setup);
  EXPECT_EQ(too_short.code, ErrorCode::InvalidArgument);
  testing::expect_on_page("map", too_short);
}

}  // namespace
}  // namespace waymark
