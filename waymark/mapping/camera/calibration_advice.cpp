#include "waymark/mapping/camera/calibration_advice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Cholesky>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/dense.hpp"

namespace waymark::internal {
namespace {

constexpr std::array<const char*, 9> kRegionNames = {
    "top left", "top", "top right", "left", "middle", "right", "bottom left", "bottom", "bottom right"};

void advise_regions(const CameraCalibration& found, std::vector<std::string>& advice) {
  constexpr std::size_t kMinCorners = 20;
  constexpr double kMaxNoiseRatio = 2;
  std::vector<std::string> empty;
  for (std::size_t i = 0; i < found.regions.size(); ++i) {
    const ImageRegion& region = found.regions[i];
    if (region.corners < kMinCorners) empty.emplace_back(kRegionNames[i]);
    if (region.corners >= kMinCorners && region.noise_scale > kMaxNoiseRatio * found.noise_scale)
      advice.push_back(fmt::format(
          "The {} of the image fits {:.1f} times worse than the whole image: this lens model cannot "
          "describe the distortion there.",
          kRegionNames[i], region.noise_scale / found.noise_scale));
  }
  if (!empty.empty())
    advice.push_back(fmt::format(
        "Too few corners in these parts of the image: {}. Hold the board there as well; otherwise the "
        "distortion there is extrapolated.",
        fmt::join(empty, ", ")));
}

void advise_views(const CameraCalibration& found, std::vector<std::string>& advice) {
  constexpr double kMinTiltDeg = 20;
  constexpr std::ptrdiff_t kMinTiltedViews = 4;
  constexpr std::ptrdiff_t kMinViews = 10;
  const auto used = std::ranges::count_if(found.views, [](const auto& view) { return view.marks > 0; });
  const auto tilted = std::ranges::count_if(
      found.views, [](const auto& view) { return view.marks > 0 && view.tilt_deg > kMinTiltDeg; });
  if (used < kMinViews)
    advice.push_back(fmt::format("Only {} usable images. Take fifteen from all sides.", used));
  if (tilted < kMinTiltedViews)
    advice.push_back(
        fmt::format("Only {} images show the board tilted by more than {} degrees. Tilt it to the left, "
                    "right, up and down; otherwise focal length and distance are indistinguishable.",
                    tilted, kMinTiltDeg));
}

void advise_numbers(const CameraCalibration& found, std::vector<std::string>& advice) {
  constexpr double kUncertainShare = 0.005;
  constexpr double kOverfitted = 1.3;
  const double share = std::sqrt(std::max(0.0, found.covariance(0, 0))) / found.parameters[0];
  if (share > kUncertainShare)
    advice.push_back(
        fmt::format("The standard deviation of the focal length is {:.1f} %. Take more images, nearer and "
                    "tilted.",
                    100 * share));
  if (found.held_out_rms_px > kOverfitted * found.rms_px)
    advice.push_back(
        fmt::format("Held-out images fit {:.2f} times worse than those used. Take more images, or use a lens "
                    "model with fewer parameters.",
                    found.held_out_rms_px / found.rms_px));
}

}  // namespace

std::vector<std::string> calibration_advice(const CameraCalibration& found) {
  std::vector<std::string> advice;
  advise_views(found, advice);
  advise_regions(found, advice);
  advise_numbers(found, advice);
  return advice;
}

namespace {

/// A linearised view: whitened residuals and their derivatives with respect to the pose and the parameters of
/// each cause.
struct ViewResiduals {
  Eigen::VectorXd r{};
  Eigen::Matrix<double, Eigen::Dynamic, 6> J_pose{};
  Eigen::Matrix<double, Eigen::Dynamic, 2>
      J_shutter{};  ///< with respect to the shift of the lower image edge relative to the upper one [px]
  Eigen::VectorXd J_focal{};  ///< with respect to the logarithm of the focal length
  Eigen::Matrix<double, Eigen::Dynamic, 3>
      J_place{};                     ///< with respect to the position of each mark on the target [m]
  std::vector<std::int64_t> keys{};  ///< key of the mark for each pair of rows
};

Eigen::Vector2d centre_of(const CameraModel& camera) {
  return std::visit([](const auto& lens) { return Eigen::Vector2d(lens.cx, lens.cy); }, camera.projection());
}

/// A key for each point; the corners of a tag have different keys.
std::int64_t key_of(const ViewMark& mark, std::size_t point) {
  return 4 * mark.seen.key + static_cast<std::int64_t>(point);
}

ViewResiduals residuals_of(const TargetView& view, const CameraModel& camera) {
  Eigen::Index rows = 0;
  for (const ViewMark& mark : view.marks) rows += mark.used ? mark.numbers() : 0;
  ViewResiduals all;
  all.r = Eigen::VectorXd::Zero(rows);
  all.J_pose.setZero(rows, 6);
  all.J_shutter.setZero(rows, 2);
  all.J_focal = Eigen::VectorXd::Zero(rows);
  all.J_place.setZero(rows, 3);
  const SE3 cam_T_target = view.target_T_cam.inverse();
  const Eigen::Matrix3d cam_R_target = cam_T_target.rotation().matrix();
  Eigen::Index row = 0;
  for (const ViewMark& mark : view.marks) {
    if (!mark.used) continue;
    const Eigen::Index n = mark.numbers();
    for (std::size_t k = 0; k < mark.seen.seen_px.size(); ++k) {
      const Eigen::Index at = row + 2 * static_cast<Eigen::Index>(k);
      Matrix23 J_px_p;
      const Eigen::Vector3d& place = mark.seen.target_points_m[k];
      const auto px = camera.project(cam_T_target * place, &J_px_p);
      all.keys.push_back(key_of(mark, k));
      if (!px) continue;
      const Matrix23 J_px_place = J_px_p * cam_R_target;
      all.r.segment<2>(at) = *px - mark.seen.seen_px[k];
      all.J_pose.block<2, 3>(at, 0) = -J_px_place;
      all.J_pose.block<2, 3>(at, 3) = J_px_place * SO3::hat(place);
      all.J_shutter.block<2, 2>(at, 0) =
          (mark.seen.seen_px[k].y() / camera.height_px() - 0.5) * Eigen::Matrix2d::Identity();
      all.J_focal.segment<2>(at) = *px - centre_of(camera);
      all.J_place.block<2, 3>(at, 0) = J_px_place;
    }
    const auto whiten = [&](auto&& block) { block = (mark.whitening * block).eval(); };
    whiten(all.r.segment(row, n));
    whiten(all.J_pose.middleRows(row, n));
    whiten(all.J_shutter.middleRows(row, n));
    whiten(all.J_focal.segment(row, n));
    whiten(all.J_place.middleRows(row, n));
    row += n;
  }
  return all;
}

/// The decrease in a view's chi2 if further unknowns are estimated in addition to its pose, and their
/// estimates.
struct Gain {
  double chi2 = 0;
  Eigen::VectorXd values{};
};

Gain gain_of(const ViewResiduals& view, const Eigen::MatrixXd& J) {
  Eigen::MatrixXd A(view.r.size(), 6 + J.cols());
  A << view.J_pose, J;
  const Eigen::MatrixXd information = transposed_product(A, A);
  const Eigen::VectorXd gradient = transposed_product(A, view.r);
  const SymmetricSolution together = solve_symmetric(information, gradient);
  const SymmetricSolution alone = solve_symmetric(information.topLeftCorner(6, 6), gradient.head(6));
  if (!together.positive || !alone.positive) return {0, Eigen::VectorXd::Zero(J.cols())};
  const Eigen::VectorXd step = -together.X.col(0);
  const double without = gradient.head(6).dot(alone.X.col(0));
  return {std::max(0.0, -gradient.dot(step) - without), step.tail(J.cols())};
}

/// A possible cause, with the decrease in chi2, the number of additional parameters, and the message.
struct Cause {
  double gain = 0;
  double numbers = 1;
  std::string words{};
};

struct Sums {
  double chi2 = 0;
  double free = 0;
};

Cause rolling_shutter(const std::vector<ViewResiduals>& views) {
  double gain = 0;
  std::vector<double> shifts;
  for (const ViewResiduals& view : views) {
    const Gain one = gain_of(view, view.J_shutter);
    gain += one.chi2;
    shifts.push_back(one.values.norm());
  }
  return {gain, 2.0 * static_cast<double>(views.size()),
          fmt::format(
              "A rolling shutter would explain the residuals: the upper and lower image edges are shifted "
              "relative to each other by {:.1f} px (median). Hold board and camera still.",
              median(shifts))};
}

/// Relative change in the focal length for some views, with the poses eliminated.
struct FocalStep {
  double information = 0;
  double gradient = 0;

  void add(const FocalStep& other) {
    information += other.information;
    gradient += other.gradient;
  }
  [[nodiscard]] double gain() const { return information > 0 ? gradient * gradient / information : 0; }
  [[nodiscard]] double share() const { return information > 0 ? -gradient / information : 0; }
};

FocalStep focal_step(const ViewResiduals& view) {
  const SymmetricSolution pose = solve_symmetric(transposed_product(view.J_pose, view.J_pose),
                                                 transposed_product(view.J_pose, view.J_focal));
  if (!pose.positive) return {};
  const Eigen::VectorXd rest = view.J_focal - product(view.J_pose, pose.X);
  return {rest.squaredNorm(), rest.dot(view.r)};
}

/// The focal length has one value up to some image, and another from that image on.
Cause focus(const std::vector<ViewResiduals>& views) {
  constexpr double kNumbers = 3;  // two focal lengths and the index of the change
  std::vector<FocalStep> steps;
  steps.reserve(views.size());
  for (const ViewResiduals& view : views) steps.push_back(focal_step(view));
  double best = 0;
  double jump = 0;
  std::size_t change = 0;
  for (std::size_t i = 2; i + 2 <= steps.size(); ++i) {
    FocalStep before;
    FocalStep after;
    for (std::size_t k = 0; k < steps.size(); ++k) (k < i ? before : after).add(steps[k]);
    const double gain = before.gain() + after.gain();
    if (gain <= best) continue;
    best = gain;
    jump = std::abs(after.share() - before.share());
    change = i;
  }
  return {best, kNumbers,
          fmt::format("The focus changed: from usable image {} on, the focal length differs by {:.1f} %. "
                      "Switch off autofocus and calibrate again.",
                      change + 1, 100 * jump)};
}

/// Information and gradient of the position of each point on the target, over all views.
struct PlaceSystem {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

Cause bent_board(const std::vector<ViewResiduals>& views) {
  std::map<std::int64_t, PlaceSystem> places;
  for (const ViewResiduals& view : views) {
    for (std::size_t i = 0; i < view.keys.size(); ++i) {
      const auto J = view.J_place.middleRows<2>(2 * static_cast<Eigen::Index>(i));
      PlaceSystem& place = places[view.keys[i]];
      place.information += J.transpose() * J;
      place.gradient += J.transpose() * view.r.segment<2>(2 * static_cast<Eigen::Index>(i));
    }
  }
  double gain = 0;
  double squares = 0;
  for (const auto& [key, place] : places) {
    const double information = place.information(2, 2);
    if (!(information > 0)) continue;
    const double height = -place.gradient.z() / information;
    gain += height * height * information;
    squares += height * height;
  }
  const auto count = static_cast<double>(places.size());
  return {
      gain, count,
      fmt::format(
          "The board is not flat: its corners deviate from a plane by {:.2g} mm (RMS) or more. Mount it on a "
          "stiff plate.",
          1e3 * std::sqrt(squares / count))};
}

/// chi2 after a fit of the camera to a board that is stretched along its rows and shortened along its columns
/// by this share.
double chi2_of_stretched(std::vector<TargetView> views, double share, const FitOptions& options,
                         const Eigen::VectorXd& parameters) {
  for (TargetView& view : views)
    for (ViewMark& mark : view.marks)
      for (Eigen::Vector3d& place : mark.seen.target_points_m)
        place = Eigen::Vector3d((1 + share) * place.x(), (1 - share) * place.y(), place.z());
  FitOptions few = options;
  few.huber_sigma = 0;
  few.max_iterations = 15;
  const auto fit = fit_intrinsics(views, parameters, few);
  return fit ? fit->chi2 : std::numeric_limits<double>::quiet_NaN();
}

/// A board whose aspect ratio differs from the specified one.
Cause wrong_size(const std::vector<TargetView>& views, const FitOptions& options,
                 const Eigen::VectorXd& parameters) {
  constexpr double kStep = 0.003;
  const double here = chi2_of_stretched(views, 0, options, parameters);
  const double more = chi2_of_stretched(views, kStep, options, parameters);
  const double less = chi2_of_stretched(views, -kStep, options, parameters);
  const double slope = (more - less) / (2 * kStep);
  const double curvature = (more + less - 2 * here) / (kStep * kStep);
  if (!(curvature > 0)) return {};
  const double share = -slope / curvature;
  return {
      slope * slope / (2 * curvature), 1,
      fmt::format(
          "The board dimensions are wrong: along its {} the board is {:.1f} % longer than given, relative to "
          "the other direction. Measure columns and rows on the print.",
          share > 0 ? "rows" : "columns", 200 * std::abs(share))};
}

}  // namespace

std::vector<std::string> calibration_causes(const std::vector<TargetView>& all, const FitOptions& options,
                                            const Eigen::VectorXd& parameters) {
  const auto camera = camera_of(options.lens, parameters, options.width_px, options.height_px);
  if (!camera) return {};
  constexpr double kMinExplainedShare = 0.1;  // as a share of chi2; smaller effects are negligible
  constexpr std::size_t kMinViewsForCauses = 5;
  constexpr Eigen::Index kMinResiduals = 16;
  std::vector<TargetView> views;
  std::vector<ViewResiduals> residuals;
  Sums sums;
  for (const TargetView& view : all) {
    ViewResiduals one = residuals_of(view, *camera);
    if (one.r.size() < kMinResiduals) continue;
    sums.chi2 += one.r.squaredNorm();
    sums.free += static_cast<double>(one.r.size() - 6);
    views.push_back(view);
    residuals.push_back(std::move(one));
  }
  if (views.size() < kMinViewsForCauses) return {};
  const std::vector<Cause> causes = {rolling_shutter(residuals), focus(residuals), bent_board(residuals),
                                     wrong_size(views, options, parameters)};
  double variance = sums.chi2 / sums.free;
  for (const Cause& cause : causes)
    if (sums.free > cause.numbers)
      variance = std::min(variance, (sums.chi2 - cause.gain) / (sums.free - cause.numbers));
  // Each additional parameter is penalised according to Schwarz, "Estimating the dimension of a model"
  // (1978).
  const auto worth = [&](const Cause& cause) {
    return cause.gain - cause.numbers * variance * std::log(sums.free);
  };
  const auto likeliest = std::ranges::max_element(causes, {}, worth);
  const bool named = worth(*likeliest) > 0 && likeliest->gain > kMinExplainedShare * sums.chi2;
  return named ? std::vector{likeliest->words} : std::vector<std::string>();
}

}  // namespace waymark::internal
