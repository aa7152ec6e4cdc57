// Tests a lap as a least-squares problem: the unknowns, the couplings, and zero cost at the true values. Then
// tests the votes of single observations.
#include "waymark/mapping/lap/lap_bundle.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using test::true_start;

LapBundle bundle_of(const RingDrive& drive) { return lap_bundle(drive.lap, true_start(drive)); }

TEST(LapBundle, HasAPoseForEachTagAndFrameAndATermForEachObservation) {
  const RingDrive drive = drive_ring();
  const LapBundle lap = bundle_of(drive);
  EXPECT_EQ(lap.tags.size(), drive.tags.tags.size());
  EXPECT_EQ(lap.base_poses().size(), drive.lap.frames.size());
  EXPECT_EQ(lap.bundle.poses.size(), 3 + lap.tags.size() + drive.lap.frames.size())
      << "map, camera and floor";
  EXPECT_EQ(lap.bundle.on_floor.size(), drive.lap.frames.size());
  EXPECT_EQ(lap.bundle.odometry.size(), drive.lap.frames.size() - 1);
  std::size_t detections = 0;
  for (const TagFrame& frame : drive.lap.frames) detections += frame.detections.size();
  ASSERT_EQ(lap.bundle.corners.size(), detections);
  ASSERT_EQ(lap.observations.size(), detections);
  for (std::size_t i = 0; i < detections; ++i) {
    const auto [frame, detection] = lap.observations[i];
    const CornerTerm& term = lap.bundle.corners[i];
    EXPECT_EQ(term.tag, lap.tags.at(drive.lap.frames[frame].detections[detection].tag));
    EXPECT_EQ(term.rig, *lap.bases[frame]);
    EXPECT_EQ(term.body, lap.map);
  }
}

TEST(LapBundle, TrueValuesHaveZeroCostAndAreAMinimum) {
  const RingDrive drive = drive_ring();
  LapBundle lap = bundle_of(drive);
  EXPECT_LT(cost(lap.bundle), 1e-6);
  ASSERT_TRUE(solve(lap.bundle).usable());
  for (const auto& [id, pose] : lap.tags)
    EXPECT_LT(minus(lap.bundle.poses[pose].value, drive.tags.tags.at(id).map_T_tag).norm(), 1e-5);
}

TEST(LapBundle, OnlyPositionAndHeadingOfTheAnchorAreFixed) {
  const RingDrive drive = drive_ring({.noise_px = 0.2});
  LapBundle lap = bundle_of(drive);
  ASSERT_TRUE(lap.anchor);
  EXPECT_EQ(*lap.anchor, lap.tags.at(ring_tag(0)));
  EXPECT_TRUE(lap.is_held(*lap.anchor));
  EXPECT_FALSE(lap.is_held(lap.tags.at(ring_tag(1))));
  ASSERT_TRUE(solve(lap.bundle).usable());
  const SE3& anchor = lap.bundle.poses[*lap.anchor].value;
  EXPECT_LT((anchor.translation() - drive.lap.map_T_anchor.translation()).norm(), 1e-6);
  const SO3 turned = drive.lap.map_T_anchor.rotation().inverse() * anchor.rotation();
  EXPECT_LT(std::abs((drive.lap.map_T_anchor.rotation() * turned.log()).z()), 1e-5);
  const BundleCovariance P = covariance(lap.bundle);
  EXPECT_TRUE(P.undetermined.empty()) << "the height of the floor is determined, as are all other unknowns";
}

TEST(LapBundle, FramesWithoutTagsArePlacedByOdometry) {
  RingDrive drive = drive_ring();
  ChainResult start = true_start(drive);
  for (std::size_t f = 10; f < 20; ++f) drive.lap.frames[f].detections.clear();
  for (std::size_t f = 0; f < 3; ++f) drive.lap.frames[f].detections.clear();
  std::erase_if(start.trajectory, [&](const StampedPose& pose) {
    const double s = to_seconds(pose.stamp - drive.truth.front().stamp);
    return s < 0.25 || (s > 0.95 && s < 1.95);
  });
  const LapBundle lap = lap_bundle(drive.lap, start);
  for (std::size_t f = 0; f < drive.lap.frames.size(); ++f) {
    ASSERT_TRUE(lap.bases[f]) << f;
    EXPECT_LT(minus(lap.bundle.poses[*lap.bases[f]].value, drive.truth[f].map_T_base).norm(), 1e-6) << f;
  }
  drive.lap.odometry.clear();
  const LapBundle without = lap_bundle(drive.lap, start);
  EXPECT_FALSE(without.bases[0]);
  EXPECT_FALSE(without.bases[15]);
  EXPECT_TRUE(without.bases[30]);
  EXPECT_TRUE(without.bundle.odometry.empty());
  EXPECT_TRUE(without.bundle.odometry_scales.at(0).fixed) << "no term determines them";
}

TEST(LapBundle, OdometryOfAKnownScaleDeterminesTheErrorOfAllSizes) {
  constexpr double kLarger = 1.02;
  RingDrive drive = drive_ring({.stated_sigma_px = 0.1, .noise_px = 0.1, .odometry_sigma_m = 5e-4});
  *drive.lap.sizes.default_size_m /= kLarger;
  for (const double own : {0.003, 0.0}) {
    LapBundle lap = lap_bundle(drive.lap, true_start(drive),
                               {.odometry_sigma_m = 5e-4, .odometry_sigma_m_per_sqrt_m = 0});
    free_sizes(own, 0.02, lap);
    lap.bundle.odometry_scales[0].sigma.distance = 0.001;
    ASSERT_TRUE(solve(lap.bundle).usable());
    const double sigma = std::sqrt(covariance(lap.bundle).common_size);
    EXPECT_LT(sigma, 0.004) << own;
    EXPECT_NEAR(lap.bundle.common_size.log_scale, std::log(kLarger), 4 * sigma) << own;
  }
}

TEST(LapBundle, SimultaneousFramesOfTwoCamerasShareABasePose) {
  const RingDrive drive = drive_ring({.rear = true});
  const LapBundle lap = bundle_of(drive);
  ASSERT_EQ(lap.more_cams.size(), 1U);
  EXPECT_EQ(drive.lap.frames.size(), 2 * drive.truth.size());
  EXPECT_EQ(lap.base_poses().size(), drive.truth.size());
  EXPECT_EQ(lap.bundle.on_floor.size(), drive.truth.size()) << "one floor term for each pose";
  bool front = false;
  bool rear = false;
  for (std::size_t i = 0; i < lap.bundle.corners.size(); ++i) {
    const CornerTerm& term = lap.bundle.corners[i];
    const bool of_rear = drive.lap.frames[lap.observations[i].frame].camera == "rear";
    EXPECT_EQ(term.cam, of_rear ? lap.more_cams[0] : lap.cam);
    EXPECT_EQ(term.camera, of_rear ? 1U : 0U);
    (of_rear ? rear : front) = true;
  }
  EXPECT_TRUE(front && rear);
  EXPECT_LT(cost(lap.bundle), 1e-6);
}

TEST(LapBundle, ObservationsWithoutACovarianceUseTheOptions) {
  RingDrive drive = drive_ring();
  for (TagFrame& frame : drive.lap.frames) {
    for (TagDetection& seen : frame.detections) seen.corner_covariance_px2.reset();
  }
  const LapBundle lap = lap_bundle(drive.lap, true_start(drive), {.corner_sigma_px = 0.5});
  ASSERT_FALSE(lap.bundle.corners.empty());
  for (const CornerTerm& term : lap.bundle.corners)
    EXPECT_LT((term.factor.whitening - 2 * CornerCovariance::Identity()).norm(), 1e-12);
}

TEST(LapBundle, OdometryNoiseGrowsWithDistance) {
  const RingDrive slow = drive_ring({.loops = 0.5, .frame_m = 0.02});
  const RingDrive quick = drive_ring({.loops = 0.5, .frame_m = 0.08});
  const auto sigma = [](const LapBundle& lap) {
    return lap.bundle.odometry.front().factor.whitening.diagonal().cwiseInverse().eval();
  };
  const LapModelOptions o;
  for (const RingDrive* drive : {&slow, &quick}) {
    const double metres = 2 * std::sin(drive == &slow ? 0.01 : 0.04);
    const double radians = drive == &slow ? 0.02 : 0.08;
    const Eigen::Vector3d s = sigma(bundle_of(*drive));
    EXPECT_NEAR(s[0], std::hypot(o.odometry_sigma_m, o.odometry_sigma_m_per_sqrt_m * std::sqrt(metres)),
                1e-9);
    EXPECT_NEAR(s[2],
                std::hypot(o.odometry_sigma_rad, o.odometry_sigma_rad_per_sqrt_m * std::sqrt(metres),
                           o.odometry_sigma_rad_per_sqrt_rad * std::sqrt(radians)),
                1e-9);
  }
}

TEST(LapBundle, ALapOnAMapWithAFloorUsesItsTilt) {
  RingDrive drive = drive_ring();
  LapPrior prior{.map = drive.tags};
  drive.lap.prior = prior;
  const LapBundle unknown = bundle_of(drive);
  EXPECT_TRUE(unknown.bundle.poses[*unknown.anchor].fixed) << "the tilt of the floor is then estimated";
  drive.lap.prior->map.floor.covariance = Eigen::Matrix3d(1e-6 * Eigen::Matrix3d::Identity());
  drive.lap.prior->map.floor.normal = Eigen::Vector3d(0.02, 0, 1).normalized();
  const LapBundle known = bundle_of(drive);
  EXPECT_FALSE(known.bundle.poses[*known.anchor].fixed);
  const Eigen::Vector3d up = known.bundle.poses[known.floor].value.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_LT((up - drive.lap.prior->map.floor.normal).norm(), 1e-9);
}

TEST(LapBundle, ATagAddedLaterGetsItsObservations) {
  const RingDrive drive = drive_ring();
  ChainResult start = true_start(drive);
  const MappedTag late = start.map.tags.at(ring_tag(5));
  start.map.tags.erase(ring_tag(5));
  LapBundle lap = lap_bundle(drive.lap, start);
  const std::size_t before = lap.bundle.corners.size();
  std::vector<LapBundle::Observation> observations;
  for (std::size_t f = 0; f < drive.lap.frames.size(); ++f) {
    for (std::size_t d = 0; d < drive.lap.frames[f].detections.size(); ++d) {
      if (drive.lap.frames[f].detections[d].tag == ring_tag(5)) observations.push_back({f, d});
    }
  }
  ASSERT_GT(observations.size(), 10U);
  add_tag(drive.lap, ring_tag(5), late.map_T_tag, observations, {}, lap);
  EXPECT_EQ(lap.bundle.corners.size(), before + observations.size());
  EXPECT_EQ(lap.observations.size(), lap.bundle.corners.size());
  EXPECT_EQ(lap.bundle.corners.size(), bundle_of(drive).bundle.corners.size());
  EXPECT_LT(cost(lap.bundle), 1e-6);
}

TEST(FloorPrior, FixesAKnownTiltAndNeverTheHeight) {
  const SE3 floor({}, {0, 0, 0.1});
  const auto off = [&](bool known, const SE3& by) {
    return pose_prior_residual(floor_prior(floor, known), by * floor).norm();
  };
  EXPECT_LT(off(true, SE3({}, {0, 0, 0.5})), 0.1);
  EXPECT_GT(off(true, SE3(SO3::exp({1e-4, 0, 0}), {0, 0, 0})), 10);
  EXPECT_LT(off(false, SE3(SO3::exp({0.1, 0, 0}), {0, 0, 0})), 1);
}

struct Sight {
  LapInput lap{
      .camera =
          CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value(),
      .base_T_cam = SE3(body_R_optical(), {0.1, 0, 0.3}),
      .sizes = {.default_size_m = 0.2}};
  SE3 map_T_base{SO3::from_rpy(0, 0, 0.6), {1, -2, 0}};
  SE3 map_T_tag{};
  TagDetection detection{.tag = {FamilyId::Tag36h11, 3}};

  Sight() {
    const SE3 cam_T_tag(SO3::exp({0.5, -0.3, 0.2}), {0.2, -0.1, 1.2});
    map_T_tag = map_T_base * lap.base_T_cam * cam_T_tag;
    detection.corners_px = *visible_corners(lap.camera, cam_T_tag, 0.2);
  }
};

TEST(TagVotes, OneOfThePosesOfATagIsTheTrueOne) {
  const Sight sight;
  const auto places = internal::vote_for_place(sight.detection, "cam", sight.lap, sight.map_T_base);
  ASSERT_FALSE(places.empty());
  EXPECT_LT(minus(places.front().value, sight.map_T_tag).norm(), 1e-6);
  EXPECT_EQ(places.front().chi2, 0);
  const auto bases = internal::vote_for_base(sight.detection, "cam", sight.lap, sight.map_T_tag);
  ASSERT_FALSE(bases.empty());
  EXPECT_LT(minus(bases.front().value, sight.map_T_base).norm(), 1e-6);
}

TEST(TagVotes, DegenerateCornersGiveNone) {
  Sight sight;
  sight.detection.corners_px[1] = sight.detection.corners_px[0];
  sight.detection.corners_px[2] = sight.detection.corners_px[0];
  EXPECT_TRUE(internal::vote_for_place(sight.detection, "cam", sight.lap, sight.map_T_base).empty());
}

}  // namespace
}  // namespace waymark
