// Walks around a room of 24 tags with a hand-held camera and a rolling shutter. The accuracy and consistency
// of the map are checked against ground truth. WAYMARK_FULL=1 runs 100 walks. For a phone video of two tags
// taped to a wall (WPIcal's field.mp4), the map is compared with a geometric measurement that needs no camera
// model.
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "tests/support/hand_walk.hpp"
#include "waymark/app/video/map_video.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/simulation/render/scene_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

constexpr double kTag_m = 0.165;
constexpr double kChi2Of3At95 = 7.815;
const TagId kAnchor{FamilyId::Tag36h11, 0};

bool full() { return std::getenv("WAYMARK_FULL") != nullptr; }

CameraModel walk_camera() {
  PinholeRadtan lens{.fx = 900, .fy = 902, .cx = 634, .cy = 366, .coefficients = 4};
  lens.k = {0.05, -0.07, 1e-3, -5e-4, 0, 0, 0, 0};
  return CameraModel::make(lens, 1280, 720).value();
}

/// Standard deviations of the intrinsics of that camera after a good calibration.
Eigen::VectorXd lens_sigma() {
  return (Eigen::VectorXd(8) << 0.6, 0.6, 0.6, 0.6, 2e-3, 4e-3, 2e-4, 2e-4).finished();
}

struct Walked {
  World world{};
  std::vector<SceneFrame> frames{};
  MapVideoJob job;
};

/// A walk and a job that maps it. The errors of the camera, the tag size and the distance are drawn from
/// their stated standard deviations.
Walked walk(std::uint64_t seed, const testing::HandWalkOptions& options) {
  Random random(seed);
  const double print = 1 + 0.003 * random.normal();
  Walked walked{.world = testing::walk_room(kTag_m * print), .job = {.camera = walk_camera()}};
  const CameraModel camera = walk_camera();
  const testing::HandWalk hand(random, options.seconds);
  walked.frames = testing::walked_views(walked.world, camera, hand, options, random);
  Eigen::VectorXd given = intrinsics_of(camera);
  for (Eigen::Index i = 0; i < given.size(); ++i) given[i] += lens_sigma()[i] * random.normal();
  walked.job.camera = with_intrinsics(camera, given).value();
  walked.job.intrinsics_sigma = lens_sigma();
  walked.job.readout_s = options.readout_s;
  walked.job.sizes.default_size_m = kTag_m;
  walked.job.search.common_tag_size_sigma_percent = 0.3;
  walked.job.anchors = {kAnchor};
  walked.job.map_T_anchor = walked.world.tags.tags.at(kAnchor).map_T_tag;
  const TagId across{FamilyId::Tag36h11, 14};
  const double true_m =
      (walked.world.tags.tags.at(across).map_T_tag.translation() - walked.job.map_T_anchor->translation())
          .norm();
  walked.job.distances = {{kAnchor, across, true_m + 0.003 * random.normal(), 0.003}};
  return walked;
}

/// Sums over all tags. `inside` is the number of tags within their 95 % ellipsoids.
struct WalkErrors {
  int tags = 0, inside = 0;
  double square_m2 = 0, nees = 0;
};

WalkErrors walk_errors(const MapVideoReport& report, const World& world) {
  WalkErrors errors;
  for (const auto& [id, truth] : world.tags.tags) {
    const MappedTag* tag = report.file.tags.find(id);
    if (id == kAnchor || tag == nullptr) continue;
    const Eigen::Vector3d off = tag->map_T_tag.translation() - truth.map_T_tag.translation();
    Eigen::Matrix<double, 3, 6> J;
    J << Eigen::Matrix3d::Identity(), -SO3::hat(tag->map_T_tag.translation());
    const Eigen::Matrix3d P = J * *tag->covariance * J.transpose();
    const double chi2 = off.dot(P.llt().solve(off));
    ++errors.tags;
    errors.inside += chi2 < kChi2Of3At95 ? 1 : 0;
    errors.square_m2 += off.squaredNorm();
    errors.nees += chi2 / 3;
  }
  return errors;
}

TEST(MapWalk, TagErrorsAreConsistentWithTheirCovariances) {
  const char* requested = std::getenv("WAYMARK_WALKS");
  const int walks = requested != nullptr ? std::atoi(requested) : full() ? 100 : 2;
  const testing::HandWalkOptions options{.seconds = 30, .rate_hz = full() ? 30.0 : 10.0};
  double share_sum = 0;
  double share_square = 0;
  double square_m2 = 0;
  double nees = 0;
  for (int n = 0; n < walks; ++n) {
    const std::uint64_t seed = 240 + static_cast<std::uint64_t>(n);
    const Walked walked = walk(seed, options);
    const auto report = map_views(walked.job, walked.frames, {});
    ASSERT_TRUE(report) << "seed " << seed << ": " << to_string(report.error());
    const WalkErrors errors = walk_errors(*report, walked.world);
    ASSERT_EQ(errors.tags, 23) << "seed " << seed;
    const double rmse_m = std::sqrt(errors.square_m2 / errors.tags);
    EXPECT_LT(rmse_m, full() ? 0.03 : 0.05) << "seed " << seed;
    const double share = static_cast<double>(errors.inside) / errors.tags;
    std::printf(
        "seed %d: rmse %.4f m, %.0f %% inside, nees %.2f, size %.4f (true %.4f +- %.4f), %.1f images as "
        "one\n",
        static_cast<int>(seed), rmse_m, 100 * share, errors.nees / errors.tags, report->map.size_scale,
        walked.world.tags.tags.at(kAnchor).size_m / kTag_m, report->map.size_sigma,
        report->map.correlated_frames);
    share_sum += share;
    share_square += share * share;
    square_m2 += errors.square_m2 / errors.tags;
    nees += errors.nees / errors.tags;
  }
  const double mean = share_sum / walks;
  // Tags in the same walk are not independent, so the interval is computed from the fractions for each walk.
  const double interval = 1.96 * std::sqrt(std::max(0.0, share_square / walks - mean * mean) / walks);
  const double rmse_m = std::sqrt(square_m2 / walks);
  std::printf("%d walks: rmse %.4f m, 95 %% ellipsoids contain %.1f +- %.1f %% of tags, nees %.2f\n", walks,
              rmse_m, 100 * mean, 100 * interval, nees / walks);
  EXPECT_LT(rmse_m, full() ? 0.011 : 0.03)
      << "at 30 images per second (target 0.010, measured 0.0103), or at 10";
  if (!full()) {
    EXPECT_GT(mean, 0.6) << "mean over two walks";
    return;
  }
  EXPECT_GT(mean, 0.92);
  EXPECT_LT(mean, 0.98);
}

TEST(MapWalk, IgnoringTheRollingShutterCostsAccuracy) {
  Walked walked = walk(240, {.seconds = 30, .rate_hz = 8});
  const auto rolling = map_views(walked.job, walked.frames, {});
  walked.job.readout_s = 0;
  const auto global = map_views(walked.job, walked.frames, {});
  ASSERT_TRUE(rolling && global);
  EXPECT_LT(rolling->map.noise_px, 0.13) << "the simulated noise is 0.11 px";
  EXPECT_GT(global->map.noise_px, 1.4 * rolling->map.noise_px);
  EXPECT_LT(walk_errors(*rolling, walked.world).square_m2, walk_errors(*global, walked.world).square_m2);
}

/// Detections from two seconds of a walk, rendered with motion blur and a rolling shutter.
std::vector<SceneFrame> filmed(const World& world, const CameraModel& camera, double readout_s) {
  SceneCameraOptions options;
  options.exposure_ms = 6;
  options.readout_ms = 1e3 * readout_s;
  const auto renderer = SceneCamera::make(scene_of(world), camera, options);
  const auto finder = make_tag_finder();
  std::vector<SceneFrame> frames;
  if (!renderer || !finder) return frames;
  Random random(77);
  const testing::HandWalk hand(random, 20);
  TagSequence sequence(*finder);
  for (int k = 0; k < 40; ++k) {
    const double t_s = 0.05 * k;
    const SensorTime stamp(std::chrono::milliseconds(50 * k));
    const auto rendered = renderer->render([&](double dt_s) { return hand.at(t_s + dt_s); }, stamp,
                                           static_cast<std::uint64_t>(k));
    if (!rendered) return {};
    auto found = sequence.find(rendered->image.view(), ImageLens::of(camera));
    if (!found) return {};
    frames.push_back({stamp, {{0, std::move(found->detections)}}});
  }
  return frames;
}

TEST(MapWalk, RollingShutterOfRenderedImagesIsCorrected) {
  constexpr double kReadout_s = 0.03;
  const World world = testing::walk_room(kTag_m);
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 450, .fy = 450, .cx = 320, .cy = 240}, 640, 480).value();
  const std::vector<SceneFrame> frames = filmed(world, camera, kReadout_s);
  ASSERT_EQ(frames.size(), 40U);
  MapVideoJob job{.camera = camera, .readout_s = kReadout_s};
  job.sizes.default_size_m = kTag_m;
  job.search.common_tag_size_sigma_percent = 0;
  job.anchors = {kAnchor};
  job.map_T_anchor = world.tags.tags.at(kAnchor).map_T_tag;
  const auto rolling = map_views(job, frames, {});
  job.readout_s = 0;
  const auto global = map_views(job, frames, {});
  ASSERT_TRUE(rolling && global) << (rolling ? "" : to_string(rolling.error()));
  const WalkErrors with = walk_errors(*rolling, world);
  const WalkErrors without = walk_errors(*global, world);
  std::printf("%d tags, rmse %.4f m and %.3f px with the readout time, %.4f m and %.3f px without\n",
              with.tags, std::sqrt(with.square_m2 / with.tags), rolling->map.noise_px,
              std::sqrt(without.square_m2 / without.tags), global->map.noise_px);
  ASSERT_GE(with.tags, 3);
  EXPECT_LT(rolling->map.noise_px, 0.7 * global->map.noise_px);
  EXPECT_LT(with.square_m2, without.square_m2);
  EXPECT_LT(std::sqrt(with.square_m2 / with.tags), 0.03);
  EXPECT_LT(with.nees / with.tags, 5);
}

TEST(MapWalk, UprightTagsLevelAMapWithATiltedAnchor) {
  Walked walked = walk(241, {.seconds = 30, .rate_hz = 8});
  const SE3 true_anchor = *walked.job.map_T_anchor;
  const SE3 tilted_anchor = true_anchor * SE3(SO3::exp({0.05, 0, 0.03}), {0, 0, 0});
  walked.job.map_T_anchor = tilted_anchor;
  const auto tilted = map_views(walked.job, walked.frames, {});
  for (int id : {0, 6, 9, 13, 16, 21}) {  // rotated in the plane of the wall by up to 0.1 rad
    const SE3& map_T_tag = walked.world.tags.tags.at({FamilyId::Tag36h11, id}).map_T_tag;
    if (std::abs((map_T_tag.rotation() * Eigen::Vector3d::UnitY()).z() + 1) < 2e-3)
      walked.job.upright.push_back({FamilyId::Tag36h11, id});
  }
  ASSERT_GE(walked.job.upright.size(), 2U);
  walked.job.level_sigma_deg = to_degrees(0.04);
  const auto level = map_views(walked.job, walked.frames, {});
  ASSERT_TRUE(tilted && level) << (level ? "" : to_string(level.error()));
  const auto height_error_m = [&](const MapVideoReport& report) {  // of a tag on the far wall
    const TagId far{FamilyId::Tag36h11, 14};
    return std::abs(report.file.tags.tags.at(far).map_T_tag.translation().z() -
                    walked.world.tags.tags.at(far).map_T_tag.translation().z());
  };
  EXPECT_GT(height_error_m(*tilted), 0.2);
  EXPECT_LT(height_error_m(*level), 0.1);
}

TEST(MapWalk, ReportsAnInconsistentDistance) {
  Walked walked = walk(242, {.seconds = 30, .rate_hz = 8});
  const TagId a{FamilyId::Tag36h11, 7};
  const TagId b{FamilyId::Tag36h11, 20};
  walked.job.distances.push_back({a, b, 4.0, 0.005});
  const auto report = map_views(walked.job, walked.frames, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->warnings, ::testing::Contains(::testing::AllOf(::testing::HasSubstr("tags 7 and 20"),
                                                                     ::testing::HasSubstr("sigma"))));
  ASSERT_EQ(report->measured.size(), 2U);
}

TEST(MapWalk, SeveralPriorTagsDefineTheMapFrame) {
  Walked walked = walk(243, {.seconds = 30, .rate_hz = 8});
  walked.job.anchors = {};
  walked.job.map_T_anchor.reset();
  walked.job.distances = {};
  Random random(5);
  for (int id : {0, 8, 14, 19}) {  // measured with a standard deviation of 5 mm
    MappedTag known = walked.world.tags.tags.at({FamilyId::Tag36h11, id});
    const Eigen::Vector3d off(random.normal(), random.normal(), random.normal());
    known.map_T_tag = SE3(known.map_T_tag.rotation(), known.map_T_tag.translation() + 0.005 * off);
    walked.job.prior.tags[{FamilyId::Tag36h11, id}] = known;
  }
  walked.job.prior_sigma_m = 0.005;
  walked.job.prior_sigma_deg = to_degrees(0.02);
  const auto report = map_views(walked.job, walked.frames, {});
  ASSERT_TRUE(report) << to_string(report.error());
  const WalkErrors errors = walk_errors(*report, walked.world);
  EXPECT_LT(std::sqrt(errors.square_m2 / errors.tags), 0.01);
  EXPECT_LT(errors.nees / errors.tags, 4);
  EXPECT_GT(report->file.tags.tags.at(kAnchor).covariance->diagonal().maxCoeff(), 0)
      << "the prior must not be treated as exact";
}

TEST(MapWalk, RejectsUnobservedTagsInMeasurements) {
  Walked walked = walk(243, {.seconds = 5, .rate_hz = 8});
  walked.job.distances = {{kAnchor, {FamilyId::Tag36h11, 99}, 1.0, 0.005}};
  const auto absent = map_views(walked.job, walked.frames, {});
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().place.key, "distance");
  EXPECT_THAT(absent.error().message, ::testing::HasSubstr("tag36h11:99"));
  walked.job.distances = {};
  walked.job.anchors = {kAnchor, walked.frames.front().views.front().detections.back().tag};
  if (walked.job.anchors.front() == walked.job.anchors.back()) walked.job.anchors.back().number = 3;
  EXPECT_FALSE(map_views(walked.job, walked.frames, {}))
      << "two anchors require a map that contains their poses";
}

const TagId kThree{FamilyId::Tag36h11, 3};
const TagId kFour{FamilyId::Tag36h11, 4};

/// Distance between the tags, computed from the homography of both squares in one plane, which requires no
/// focal length. It uses OpenCV's findHomography and the corners in 32 images, detected with OpenCV's aruco
/// module. The distance and rotation between the squares are estimated with Gauss-Newton (0.2 px rms): 0.5100
/// m without a lens model, and 0.5120 m with the one from testcalibration.mp4.
constexpr double kApart_m = 0.511;
constexpr double kApartSigma_m = 0.002;

/// OpenCV's calibration from testcalibration.mp4 (ChArUco, DICT_5X5_1000, 12 x 8 squares of 0.709 in, markers
/// of 0.551 in). The board always faces the camera and hardly moves, so its 53 images contain no more
/// information than a single one. OpenCV's standard deviations are therefore multiplied by the square root of
/// 53.
MapVideoJob field_job(const std::filesystem::path& video) {
  PinholeRadtan lens{.fx = 2124.8, .fy = 2123.8, .cx = 989.8, .cy = 537.5, .coefficients = 4};
  lens.k = {0.21398, -1.45215, 0.001403, 0.000213, 0, 0, 0, 0};
  MapVideoJob job{.videos = {video.string()}, .camera = CameraModel::make(lens, 1920, 1080).value()};
  job.intrinsics_sigma = (Eigen::VectorXd(8) << 450, 450, 13, 13, 0.087, 1.16, 0.0013, 0.0017).finished();
  job.sizes.default_size_m = kWpilibTagSize_m;
  job.anchors = {kThree};
  return job;
}

/// The detections in every image, computed only once.
const std::vector<SceneFrame>& field_frames(const std::filesystem::path& video) {
  static const std::vector<SceneFrame> frames = [&] {
    std::vector<SceneFrame> all;
    const Result<TagFinder> finder = make_tag_finder({.detector = "waymark"});
    const auto add = [&](const VideoFrame& image, TagFrame& tags) -> Status {
      all.push_back({image.stamp, {{0, std::move(tags.detections)}}});
      return {};
    };
    const CameraModel camera = *field_job(video).camera;
    if (finder) static_cast<void>(find_video_tags(video.string(), *finder, ImageLens::of(camera), {}, add));
    return all;
  }();
  return frames;
}

struct Apart {
  double distance_m = 0, sigma_m = 0;
};

Apart apart(const MapVideoReport& report) {
  const MappedTag& three = report.file.tags.tags.at(kThree);
  const MappedTag& four = report.file.tags.tags.at(kFour);
  const Eigen::Vector3d between = four.map_T_tag.translation() - three.map_T_tag.translation();
  Eigen::Matrix<double, 3, 6> J;  // tag 3 is exact, so it contributes nothing
  J << Eigen::Matrix3d::Identity(), -SO3::hat(four.map_T_tag.translation());
  const Eigen::Vector3d along = between.normalized();
  return {between.norm(), std::sqrt(along.dot(J * *four.covariance * J.transpose() * along))};
}

TEST(FieldVideo, CovarianceIncludesTheCalibrationError) {
  WAYMARK_REAL_DATA(video, "wpical/field.mp4");
  const auto report = map_views(field_job(video), field_frames(video), {});
  ASSERT_TRUE(report) << to_string(report.error());
  const Apart found = apart(*report);
  std::printf("tags 3 and 4 are %.4f +- %.4f m apart (%.3f by geometry); chi2 per dof %.2f\n",
              found.distance_m, found.sigma_m, kApart_m, report->corner_chi2_per_dof);
  EXPECT_NEAR(found.distance_m, kApart_m, 3 * std::hypot(found.sigma_m, kApartSigma_m));
  EXPECT_LT(found.sigma_m, 0.1);
  EXPECT_GT(report->corner_chi2_per_dof, 16);
  EXPECT_THAT(report->warnings, ::testing::Contains(::testing::HasSubstr("detector's covariances")));
}

TEST(FieldVideo, AFlatWallDeterminesTheFocalLength) {
  WAYMARK_REAL_DATA(video, "wpical/field.mp4");
  MapVideoJob job = field_job(video);
  job.planes = {{kThree, kFour}};
  const auto report = map_views(job, field_frames(video), {});
  ASSERT_TRUE(report) << to_string(report.error());
  const Apart found = apart(*report);
  ASSERT_FALSE(report->map.intrinsics.empty());
  const FoundIntrinsics& lens = report->map.intrinsics.front();
  std::printf("on one wall: %.4f +- %.4f m apart, focal length %.0f +- %.0f px\n", found.distance_m,
              found.sigma_m, lens.found[0], lens.sigma[0]);
  EXPECT_NEAR(found.distance_m, kApart_m, 3 * std::hypot(found.sigma_m, kApartSigma_m));
  EXPECT_LT(found.sigma_m, 0.012);
  // The orthogonality of the axes of the plane in single images gives 1690 to 1790 px, depending on the lens
  // model and the constraint.
  EXPECT_NEAR(lens.found[0], 1740, 50 + 2 * lens.sigma[0]);
  EXPECT_LT(lens.sigma[0], 0.7 * lens.prior_sigma[0])
      << "the camera hardly moves, so successive images count as one";
}

TEST(MapVideoPrior, OfAnotherPlaceIsRefused) {
  Walked walked = walk(242, {.seconds = 20, .rate_hz = 6});
  walked.job.map_T_anchor.reset();
  walked.job.distances.clear();
  const TagMap here = walked.world.tags;
  walked.job.prior = here;
  const auto report = map_views(walked.job, walked.frames, {});
  ASSERT_TRUE(report) << to_string(report.error());
  // Each tag but the anchor is at the place of the next one.
  const MappedTag* next = &here.tags.rbegin()->second;
  for (auto& [id, tag] : walked.job.prior.tags) {
    if (id == kAnchor) continue;
    tag.map_T_tag = next->map_T_tag;
    next = &here.tags.at(id);
  }
  const auto elsewhere = map_views(walked.job, walked.frames, {});
  ASSERT_FALSE(elsewhere);
  EXPECT_EQ(elsewhere.error().code, ErrorCode::NotFound);
  EXPECT_EQ(elsewhere.error().place.key, "prior");
  testing::expect_on_page("map", elsewhere.error());
}

}  // namespace
}  // namespace waymark
