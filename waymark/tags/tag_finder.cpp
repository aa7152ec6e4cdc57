#include "waymark/tags/tag_finder.hpp"

#include <algorithm>
#include <utility>

#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/straight_view.hpp"

namespace waymark {
namespace {

/// Drops tags that the camera model does not cover. Their bearings are undefined.
void drop_beyond_lens(const CameraModel* camera, FoundTags& found) {
  if (camera == nullptr) return;
  found.beyond_lens = std::erase_if(found.detections,
                                    [&](const TagDetection& tag) { return !camera->covers(tag.corners_px); });
}

/// The same tag in a view without distortion; empty if it is not found there.
std::optional<TagDetection> find_again(const StraightView& view, const TagFinder& finder,
                                       const TagDetection& detection) {
  const auto expected_px = view.from_camera(center_px(detection.corners_px));
  const auto found = finder.detector->detect(view.image());
  if (!expected_px || !found) return std::nullopt;
  for (const TagDetection& other : *found)
    if (other.tag == detection.tag &&
        (center_px(other.corners_px) - *expected_px).norm() < 0.25 * mean_side_px(detection.corners_px))
      return other;
  return std::nullopt;
}

/// Replaces corners and covariance by those of the corresponding pixels of the camera.
bool move_to_camera(const StraightView& view, RefinedCorners& corners) {
  // Bilinear interpolation reduces the variance of white noise to 4/9 on average, but makes it correlated, so
  // a position contains no more information than before.
  const double interpolation = corners.refined() ? 9.0 / 4.0 : 1.0;
  CornerCovariance J = CornerCovariance::Zero();
  for (Eigen::Index k = 0; k < 4; ++k) {
    Eigen::Matrix2d J_px_view;
    Eigen::Vector2d& corner = corners.corners_px[static_cast<std::size_t>(k)];
    const auto px = view.to_camera(corner, &J_px_view);
    if (!px) return false;
    corner = *px;
    J.block<2, 2>(2 * k, 2 * k) = J_px_view;
  }
  corners.covariance_px2 = (interpolation * J * corners.covariance_px2 * J.transpose()).eval();
  return true;
}

/// Finds and refines the tag in a view without distortion. Empty if it is not found there.
std::optional<RefinedCorners> refine_in_straight_view(const ImageView& image, const TagFinder& finder,
                                                      const CameraModel& camera,
                                                      const TagDetection& detection) {
  const auto view = StraightView::around(image, camera, detection.corners_px);
  if (!view) return std::nullopt;
  const auto straight = find_again(*view, finder, detection);
  if (!straight) return std::nullopt;
  RefinementOptions options = *finder.refinement;
  options.curvature_per_px = 0;
  RefinedCorners corners = refine_corners(view->image(), *straight, options);
  if (!move_to_camera(*view, corners)) return std::nullopt;
  return corners;
}

/// The refinement models edges that bulge by up to a pixel. A stronger distortion also misplaces the sides of
/// the detected quad. The tag is then found again in a view without distortion, and only the corners in that
/// view are used. With a weaker distortion, this is tried if the refinement fails.
RefinedCorners refine(const ImageView& image, const TagFinder& finder, const CameraModel* camera,
                      const TagDetection& detection) {
  constexpr double kMaxBulge_px = 1;
  constexpr double kNegligibleBulge_px = 0.2;
  const double bulge_px = camera == nullptr ? 0 : edge_bulge_px(*camera, detection.corners_px).value_or(0);
  const auto in_view = [&] { return refine_in_straight_view(image, finder, *camera, detection); };
  if (bulge_px > kMaxBulge_px)
    if (const auto corners = in_view()) return *corners;
  const RefinedCorners corners = refine_corners(image, detection, *finder.refinement, camera);
  if (corners.refined() || bulge_px > kMaxBulge_px || bulge_px < kNegligibleBulge_px) return corners;
  const auto straight = in_view();
  return straight && straight->refined() ? *straight : corners;
}

void refine_all(const ImageView& image, const TagFinder& finder, const CameraModel* camera,
                FoundTags& found) {
  drop_beyond_lens(camera, found);
  if (!finder.refinement) return;
  for (TagDetection& detection : found.detections) {
    const RefinedCorners refined = refine(image, finder, camera, detection);
    detection.corners_px = refined.corners_px;
    detection.corner_covariance_px2 = refined.covariance_px2;
    detection.corner_state = refined.state;
    found.refinements.push_back(refined.outcome);
  }
}

}  // namespace

Result<TagFinder> make_tag_finder(std::unique_ptr<Detector> detector, const RefinementOptions& refinement) {
  if (detector == nullptr) {
    return fail(ErrorCode::InvalidArgument, "the detector is missing", {}, "Create a detector first.");
  }
  if (const Status status = check_ranges(refinement); !status) return tl::unexpected<Error>(status.error());
  return TagFinder{std::move(detector), refinement};
}

Result<TagFinder> make_tag_finder(const DetectorOptions& detector, const RefinementOptions& refinement) {
  auto made = make_detector(detector);
  if (!made) return tl::unexpected(made.error());
  Result<TagFinder> finder = make_tag_finder(std::move(*made), refinement);
  if (finder) finder->tracking.detector = detector;
  return finder;
}

Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder, ImageLens lens) {
  auto detections = finder.detector->detect(image);
  if (!detections) return tl::unexpected(detections.error());
  FoundTags found{std::move(*detections)};
  refine_all(image, finder, lens.camera(), found);
  return found;
}

Result<FoundTags> TagSequence::find(const ImageView& image, ImageLens lens,
                                    std::span<const ExpectedTag> expected) {
  // Without tracking or expected tags, live and offline results are identical to the last bit.
  if (finder_->tracking.whole_every == 1 && expected.empty() && !tracker_)
    return find_tags(image, *finder_, lens);
  if (!tracker_) {
    auto made = TagTracker::make(*finder_->detector, finder_->tracking);
    if (!made) return tl::unexpected(made.error());
    tracker_.emplace(std::move(*made));
  }
  auto tracked = tracker_->next(image, expected);
  if (!tracked) return tl::unexpected(tracked.error());
  FoundTags found{.detections = std::move(tracked->detections), .missed = std::move(tracked->missed)};
  // Excludes tags that are predicted here only from the preceding images.
  std::erase_if(found.missed, [&](const MissedTag& missed) {
    return std::ranges::none_of(expected,
                                [&](const ExpectedTag& tag) { return tag.tag == missed.expected.tag; });
  });
  refine_all(image, *finder_, lens.camera(), found);
  return found;
}

}  // namespace waymark
