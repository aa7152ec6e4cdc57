#include "waymark/mapping/solver/missing_tags.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kNever_s = -std::numeric_limits<double>::infinity();
/// The number of images from which a tag that none of them shows may be missing.
constexpr int kMinExpectedImages = 10;

/// A tag that faces the camera of an image and lies inside of it, or that was detected there.
struct TagView {
  std::size_t image = 0;
  Eigen::Vector3d tag_p_cam = Eigen::Vector3d::Zero();
  double side_px = 0;
  double incidence_rad = 0;
  bool detected = false;
  bool inside = false;     ///< in the image, with a margin
  bool supported = false;  ///< near the viewpoint of a detection during another pass
  bool beside = false;     ///< in an image that shows a neighbour in a similar direction, not closer
};

/// Views of one tag without longer gaps.
struct TagPass {
  std::vector<TagView> views{};
  [[nodiscard]] bool detected() const { return std::ranges::any_of(views, &TagView::detected); }
};

/// The kinds of reasons to expect a tag in an image.
using Reason = bool TagView::*;

/// How far corners may be from where the poses of image and tag place them, in addition to the usual margin.
double shift_px(const PlacedImage& image, double px_per_m, double distance_m) {
  return px_per_m * std::hypot(image.sigma_m, image.sigma_rad * distance_m);
}

bool shows_used(const PlacedImage& image) { return std::ranges::any_of(image.detected, &DetectedTag::used); }

/// The view of a tag from an image. Empty if it does not face the camera or is outside of the image.
std::optional<TagView> view_of(const CameraModel& camera, const PlacedImage& image, std::size_t index,
                               const PlacedTag& tag) {
  constexpr VisibilityLimits kAnyVisible{.min_side_px = 4, .max_incidence_rad = 1.4, .margin_px = 0};
  constexpr double kMargin_px = 4;
  constexpr double kMarginShare = 0.2;  // of the side: the white border of the tag
  constexpr double kSigmas = 3;
  const SE3 cam_T_tag = image.map_T_cam.inverse() * tag.map_T_tag;
  const auto corners = visible_corners(camera, cam_T_tag, tag.size_m, kAnyVisible);
  if (!corners) return std::nullopt;
  const Eigen::Vector3d& cam_p = cam_T_tag.translation();
  TagView view{
      .image = index, .tag_p_cam = cam_T_tag.inverse().translation(), .side_px = mean_side_px(*corners)};
  view.incidence_rad =
      std::acos(std::clamp(cam_T_tag.rotation().matrix().col(2).dot(cam_p.normalized()), -1.0, 1.0));
  const Eigen::Vector2d center = center_px(*corners);
  view.detected = std::ranges::any_of(image.detected, [&](const DetectedTag& seen) {
    return seen.tag == tag.tag && (seen.center_px - center).norm() < view.side_px;
  });
  double margin_px = kMargin_px + kMarginShare * view.side_px;
  if (!shows_used(image)) margin_px += kSigmas * shift_px(image, view.side_px / tag.size_m, cam_p.norm());
  view.inside = std::ranges::all_of(*corners, [&](const Eigen::Vector2d& px) {
    return px.x() > margin_px && px.y() > margin_px && px.x() < camera.width_px() - margin_px &&
           px.y() < camera.height_px() - margin_px;
  });
  return view;
}

/// Tags by the cubes of space that they are in.
class TagGrid {
 public:
  TagGrid(const std::vector<PlacedTag>& tags, double cube_m) : cube_m_(cube_m) {
    for (std::size_t i = 0; i < tags.size(); ++i)
      cubes_[cube_of(tags[i].map_T_tag.translation())].push_back(i);
  }
  /// Calls `visit` for each tag within one cube.
  template <class Visit>
  void for_near(const Eigen::Vector3d& map_p, const Visit& visit) const {
    const auto [x, y, z] = cube_of(map_p);
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const auto cube = cubes_.find({x + dx, y + dy, z + dz});
          if (cube != cubes_.end()) std::ranges::for_each(cube->second, visit);
        }
      }
    }
  }

 private:
  [[nodiscard]] std::array<int, 3> cube_of(const Eigen::Vector3d& p) const {
    const auto at = [&](double x) { return static_cast<int>(std::floor(x / cube_m_)); };
    return {at(p.x()), at(p.y()), at(p.z())};
  }

  double cube_m_;
  std::map<std::array<int, 3>, std::vector<std::size_t>> cubes_{};
};

using TagsById = std::map<TagId, const PlacedTag*>;

TagsById by_id_of(const std::vector<PlacedTag>& tags) {
  TagsById by_id;
  for (const PlacedTag& tag : tags) by_id[tag.tag] = &tag;
  return by_id;
}

/// The largest distance of a detected tag from the camera.
double reach_m(const std::vector<PlacedImage>& images, const std::vector<PlacedTag>& tags) {
  const TagsById by_id = by_id_of(tags);
  double farthest = 0;
  for (const PlacedImage& image : images) {
    for (const DetectedTag& seen : image.detected) {
      const auto tag = by_id.find(seen.tag);
      if (!seen.used || tag == by_id.end()) continue;
      const Eigen::Vector3d map_p = tag->second->map_T_tag.translation() - image.map_T_cam.translation();
      farthest = std::max(farthest, map_p.norm());
    }
  }
  return farthest;
}

/// Divides the views of a tag, in order, into passes.
std::vector<TagPass> passes_of(const std::vector<TagView>& views, const std::vector<PlacedImage>& images) {
  constexpr double kGap_s = 3;
  std::vector<TagPass> passes;
  double last_s = kNever_s;
  for (const TagView& view : views) {
    const double now_s = images[view.image].time_s;
    if (now_s - last_s > kGap_s) passes.emplace_back();
    passes.back().views.push_back(view);
    last_s = now_s;
  }
  return passes;
}

/// A viewpoint, and how far around it a tag is expected to be visible as well.
struct Viewpoint {
  std::size_t camera = 0;
  Eigen::Vector3d tag_p_cam = Eigen::Vector3d::Zero();

  [[nodiscard]] double distance_to(std::size_t other_camera, const Eigen::Vector3d& other) const {
    return other_camera == camera ? (other - tag_p_cam).norm() : std::numeric_limits<double>::infinity();
  }
};

double radius_m(const Eigen::Vector3d& tag_p_cam) {
  constexpr double kRadius_m = 0.05;
  constexpr double kRadiusShare = 0.1;  // of the distance
  return kRadius_m + kRadiusShare * tag_p_cam.norm();
}

bool is_near(const std::vector<Viewpoint>& viewpoints, std::size_t camera, const Eigen::Vector3d& tag_p_cam,
             double share) {
  const double radius = share * radius_m(tag_p_cam);
  return std::ranges::any_of(viewpoints, [&](const Viewpoint& viewpoint) {
    return viewpoint.distance_to(camera, tag_p_cam) < radius;
  });
}

/// The viewpoints of the detections in a pass, except for those that are close to others.
std::vector<Viewpoint> viewpoints_of(const TagPass& pass, const std::vector<PlacedImage>& images) {
  constexpr double kApart = 0.3;  // of the radius
  std::vector<Viewpoint> viewpoints;
  for (const TagView& view : pass.views) {
    const std::size_t camera = images[view.image].camera;
    if (view.detected && !is_near(viewpoints, camera, view.tag_p_cam, kApart))
      viewpoints.push_back({camera, view.tag_p_cam});
  }
  return viewpoints;
}

/// Marks the views near a viewpoint from which another pass detected the tag.
void mark_supported(const std::vector<PlacedImage>& images, std::vector<TagPass>& passes) {
  std::vector<std::vector<Viewpoint>> viewpoints;
  viewpoints.reserve(passes.size());
  for (const TagPass& pass : passes) viewpoints.push_back(viewpoints_of(pass, images));
  for (std::size_t p = 0; p < passes.size(); ++p) {
    for (TagView& view : passes[p].views) {
      for (std::size_t q = 0; q < passes.size() && !view.supported; ++q)
        view.supported = q != p && is_near(viewpoints[q], images[view.image].camera, view.tag_p_cam, 1);
    }
  }
}

/// The sizes and angles at which most tags were detected.
struct UsualViews {
  double min_side_px = 0;
  double max_incidence_rad = 0;
};

using AllPasses = std::vector<std::vector<TagPass>>;

UsualViews usual_views(const AllPasses& tags) {
  constexpr double kExtremes = 0.1;
  std::vector<double> sides;
  std::vector<double> angles;
  for (const std::vector<TagPass>& passes : tags) {
    for (const TagPass& pass : passes) {
      for (const TagView& view : pass.views) {
        if (!view.detected) continue;
        sides.push_back(view.side_px);
        angles.push_back(view.incidence_rad);
      }
    }
  }
  if (sides.empty()) return {};
  return {quantile(std::move(sides), kExtremes), quantile(std::move(angles), 1 - kExtremes)};
}

/// Whether an obstacle that hides a tag from an image would probably hide this neighbour as well. The
/// neighbour is then in a similar direction and not closer to the camera.
bool is_hidden_together(const PlacedImage& image, const PlacedTag& tag, const PlacedTag& neighbour) {
  constexpr double kMaxAngle_rad = 0.6;
  constexpr double kMinDistanceShare = 0.9;
  if (image.time_s < neighbour.since_s) return false;
  const Eigen::Vector3d map_p_tag = tag.map_T_tag.translation() - image.map_T_cam.translation();
  const Eigen::Vector3d map_p_neighbour = neighbour.map_T_tag.translation() - image.map_T_cam.translation();
  const double tag_m = map_p_tag.norm();
  const double neighbour_m = map_p_neighbour.norm();
  return neighbour_m >= kMinDistanceShare * tag_m &&
         map_p_tag.dot(map_p_neighbour) >= std::cos(kMaxAngle_rad) * tag_m * neighbour_m;
}

/// Whether an image shows a neighbour that an obstacle in front of the tag would probably hide.
bool shows_neighbour(const PlacedImage& image, const PlacedTag& tag, const TagsById& by_id) {
  return std::ranges::any_of(image.detected, [&](const DetectedTag& seen) {
    if (!seen.used || std::ranges::find(tag.neighbours, seen.tag) == tag.neighbours.end()) return false;
    const auto neighbour = by_id.find(seen.tag);
    return neighbour != by_id.end() && is_hidden_together(image, tag, *neighbour->second);
  });
}

/// Marks the usual views of tags beside a neighbour, if there are tags without a detection.
void mark_beside(const std::vector<PlacedImage>& images, const std::vector<PlacedTag>& tags, AllPasses& all) {
  const auto detected = [](const std::vector<TagPass>& passes) {
    return std::ranges::any_of(passes, &TagPass::detected);
  };
  if (std::ranges::all_of(all, detected)) return;
  const UsualViews usual = usual_views(all);
  const TagsById by_id = by_id_of(tags);
  for (std::size_t t = 0; t < all.size(); ++t) {
    for (TagPass& pass : all[t]) {
      for (TagView& view : pass.views) {
        view.beside = view.side_px >= usual.min_side_px && view.incidence_rad <= usual.max_incidence_rad &&
                      shows_neighbour(images[view.image], tags[t], by_id);
      }
    }
  }
}

/// A time during which a camera has no used detection.
struct BlindPeriod {
  std::size_t camera = 0;
  int after = 0;      ///< number of the camera's images with a used detection that precede it
  bool ends = false;  ///< whether another one of these images follows

  friend auto operator<=>(const BlindPeriod&, const BlindPeriod&) = default;
  /// Before the first detection and after the last one, the camera may be covered for all that is known.
  [[nodiscard]] bool is_between_detections() const { return after > 0 && ends; }
};

/// For each image without a used detection, the period to which it belongs. Empty for other images.
std::vector<std::optional<BlindPeriod>> blind_periods(const std::vector<PlacedImage>& images) {
  std::map<std::size_t, int> all;
  for (const PlacedImage& image : images) all[image.camera] += shows_used(image) ? 1 : 0;
  std::map<std::size_t, int> so_far;
  std::vector<std::optional<BlindPeriod>> of_images(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::size_t camera = images[i].camera;
    if (shows_used(images[i]))
      ++so_far[camera];
    else
      of_images[i] = BlindPeriod{camera, so_far[camera], so_far[camera] < all[camera]};
  }
  return of_images;
}

/// Clears the reasons of views in images that do not count. Images without a used detection are beside no
/// neighbour.
void drop_blind_images(const std::vector<PlacedImage>& images, AllPasses& all) {
  const auto periods = blind_periods(images);
  std::map<BlindPeriod, std::set<std::size_t>> expected;
  for (std::size_t t = 0; t < all.size(); ++t) {
    for (const TagPass& pass : all[t]) {
      for (const TagView& view : pass.views) {
        const auto& period = periods[view.image];
        if (period && view.supported) expected[*period].insert(t);
      }
    }
  }
  for (std::vector<TagPass>& passes : all) {
    for (TagPass& pass : passes) {
      for (TagView& view : pass.views) {
        const auto& period = periods[view.image];
        if (!period || !view.supported) continue;
        view.supported = images[view.image].detected.empty() && period->is_between_detections() &&
                         expected[*period].size() == 1;
      }
    }
  }
}

internal::PassCount count_of(const TagPass& pass, Reason reason) {
  internal::PassCount count;
  for (const TagView& view : pass.views) {
    if (!view.inside || !(view.*reason)) continue;
    ++count.expected;
    count.detected += view.detected ? 1 : 0;
  }
  return count;
}

/// The first pass after the last one with a detection.
std::size_t first_without(const std::vector<TagPass>& passes) {
  for (std::size_t p = passes.size(); p-- > 0;) {
    if (passes[p].detected()) return p + 1;
  }
  return 0;
}

/// The counts in the passes of a tag up to its last detection. In later passes, it may be missing.
std::vector<internal::PassCount> measured_passes(const std::vector<TagPass>& passes, Reason reason) {
  constexpr int kMinImages = 3;
  std::vector<internal::PassCount> counts;
  for (std::size_t p = 0; p < first_without(passes); ++p) {
    const internal::PassCount count = count_of(passes[p], reason);
    if (count.expected >= kMinImages) counts.push_back(count);
  }
  return counts;
}

std::vector<internal::PassCount> measured_passes(const AllPasses& all, Reason reason) {
  std::vector<internal::PassCount> counts;
  for (const std::vector<TagPass>& passes : all) {
    const std::vector<internal::PassCount> of_tag = measured_passes(passes, reason);
    counts.insert(counts.end(), of_tag.begin(), of_tag.end());
  }
  return counts;
}

/// The numbers of expected images in the passes after the last detection of a tag.
std::vector<int> expected_after_last(const std::vector<TagPass>& passes, Reason reason) {
  std::vector<int> expected;
  for (std::size_t p = first_without(passes); p < passes.size(); ++p) {
    const int images = count_of(passes[p], reason).expected;
    if (images > 0) expected.push_back(images);
  }
  return expected;
}

/// The number of tags that would be reported as missing if enough of their images did not show them.
std::size_t tested_tags(const AllPasses& all) {
  const auto is_tested = [](const std::vector<TagPass>& passes, Reason reason) {
    int expected = 0;
    for (const TagPass& pass : passes) expected += count_of(pass, reason).expected;
    return expected >= kMinExpectedImages;
  };
  return static_cast<std::size_t>(std::ranges::count_if(all, [&](const std::vector<TagPass>& passes) {
    return is_tested(passes, &TagView::supported) || is_tested(passes, &TagView::beside);
  }));
}

/// The probability that passes with these numbers of expected images show a tag in none of them.
double probability_of_none_in_all(const std::vector<int>& expected,
                                  const std::vector<internal::PassCount>& measured) {
  double probability = 1;
  for (const int images : expected) probability *= internal::probability_of_none(images, measured);
  return probability;
}

std::optional<MissingTag> missing_tag(const TagId& tag, const std::vector<TagPass>& passes, Reason reason,
                                      const std::vector<internal::PassCount>& measured,
                                      double max_probability) {
  constexpr std::size_t kMinMeasured = 3;
  const std::vector<int> expected = expected_after_last(passes, reason);
  const int images = std::accumulate(expected.begin(), expected.end(), 0);
  if (images < kMinExpectedImages || measured.size() < kMinMeasured) return std::nullopt;
  double probability = probability_of_none_in_all(expected, measured);
  const std::vector<internal::PassCount> own = measured_passes(passes, reason);
  // A tag that is dirty or often hidden is not like the others.
  if (std::ranges::find(own, 0, &internal::PassCount::detected) != own.end())
    probability = std::max(probability, probability_of_none_in_all(expected, own));
  if (probability > max_probability) return std::nullopt;
  return MissingTag{.tag = tag, .expected_images = images, .passes = static_cast<int>(expected.size())};
}

/// The time of the last detection of each tag at its place.
std::optional<double> last_detection_s(const std::vector<TagPass>& passes,
                                       const std::vector<PlacedImage>& images) {
  std::optional<double> last_s;
  for (const TagPass& pass : passes) {
    for (const TagView& view : pass.views) {
      if (view.detected) last_s = images[view.image].time_s;
    }
  }
  return last_s;
}

/// The families that the detector found. It may not have searched for others.
std::set<FamilyId> detected_families(const std::vector<PlacedImage>& images) {
  std::set<FamilyId> families;
  for (const PlacedImage& image : images) {
    for (const DetectedTag& seen : image.detected) families.insert(seen.tag.family);
  }
  return families;
}

/// The passes of each tag; none for tags of families without a detection.
AllPasses passes_of_all(const std::vector<CameraModel>& cameras, const std::vector<PlacedImage>& images,
                        const std::vector<PlacedTag>& tags) {
  const std::set<FamilyId> families = detected_families(images);
  std::vector<std::vector<TagView>> views(tags.size());
  const TagGrid grid(tags, std::max(reach_m(images, tags), 1e-3));
  for (std::size_t i = 0; i < images.size(); ++i) {
    grid.for_near(images[i].map_T_cam.translation(), [&](std::size_t t) {
      if (images[i].time_s < tags[t].since_s || !families.contains(tags[t].tag.family)) return;
      const auto view = view_of(cameras[images[i].camera], images[i], i, tags[t]);
      if (view && (view->inside || view->detected)) views[t].push_back(*view);
    });
  }
  AllPasses all;
  all.reserve(tags.size());
  for (const std::vector<TagView>& of_tag : views) {
    all.push_back(passes_of(of_tag, images));
    mark_supported(images, all.back());
  }
  mark_beside(images, tags, all);
  drop_blind_images(images, all);
  return all;
}

}  // namespace

PlacedImage placed_image(const SE3& map_T_cam, const Matrix6& covariance) {
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{map_T_cam, covariance});
  return {.map_T_cam = map_T_cam,
          .sigma_m = std::sqrt(std::max(P.diagonal().head<3>().maxCoeff(), 0.0)),
          .sigma_rad = std::sqrt(std::max(P.diagonal().tail<3>().maxCoeff(), 0.0))};
}

double internal::probability_of_none(int expected, const std::vector<PassCount>& passes) {
  constexpr double kPrior = 0.5;  // passes with a uniform distribution of the rate
  // The mean of (1 - rate)^n for a beta distribution of the rate.
  const auto none = [&](double a, double b) {
    const double n = expected;
    return std::exp(std::lgamma(b + n) - std::lgamma(b) + std::lgamma(a + b) - std::lgamma(a + b + n));
  };
  double sum = kPrior * none(1, 1);
  for (const PassCount& pass : passes) sum += none(pass.detected + 0.5, pass.expected - pass.detected + 0.5);
  return sum / (kPrior + static_cast<double>(passes.size()));
}

std::vector<MissingTag> missing_tags(const std::vector<CameraModel>& cameras,
                                     const std::vector<PlacedImage>& images,
                                     const std::vector<PlacedTag>& tags) {
  constexpr double kFalseReportsPerMap = 0.05;
  const AllPasses all = passes_of_all(cameras, images, tags);
  const std::vector<internal::PassCount> supported = measured_passes(all, &TagView::supported);
  const std::vector<internal::PassCount> beside = measured_passes(all, &TagView::beside);
  const double max_probability =
      kFalseReportsPerMap / static_cast<double>(std::max<std::size_t>(tested_tags(all), 1));
  std::vector<MissingTag> missing;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const std::optional<double> last_s = last_detection_s(all[t], images);
    auto found = last_s ? missing_tag(tags[t].tag, all[t], &TagView::supported, supported, max_probability)
                        : missing_tag(tags[t].tag, all[t], &TagView::beside, beside, max_probability);
    if (!found) continue;
    found->last_seen_s = last_s;
    missing.push_back(*found);
  }
  return missing;
}

}  // namespace waymark
