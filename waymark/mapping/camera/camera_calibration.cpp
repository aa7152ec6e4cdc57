#include "waymark/mapping/camera/camera_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/mapping/camera/calibration_advice.hpp"
#include "waymark/mapping/camera/calibration_search.hpp"

namespace waymark {
namespace {

using internal::begin_search;
using internal::find_better_poses;
using internal::FitOptions;
using internal::IntrinsicsFit;
using internal::mark_chi2;
using internal::regions_of;
using internal::root_mean;
using internal::Search;
using internal::squared_distances_px2;
using internal::summary_of;
using internal::TargetView;
using internal::usable;
using internal::view_mark;
using internal::ViewMark;
constexpr std::size_t kMinUsableViews = 3;

Result<std::vector<TargetView>> views_of(const std::vector<TargetMarks>& images, double corner_sigma_px) {
  std::vector<TargetView> views;
  for (const TargetMarks& image : images) {
    TargetView view;
    for (const TargetMark& mark : image) {
      auto seen = view_mark(mark, corner_sigma_px);
      if (!seen) return tl::unexpected(seen.error());
      view.marks.push_back(*std::move(seen));
    }
    if (!usable(view)) view.marks.clear();
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<TargetView> usable_views(const std::vector<TargetView>& views) {
  std::vector<TargetView> kept;
  for (const TargetView& view : views)
    if (usable(view)) kept.push_back(view);
  return kept;
}

/// Copies the fitted views back to their original positions.
void restore_frames(const std::vector<TargetView>& fitted, std::vector<TargetView>& views) {
  std::size_t next = 0;
  for (TargetView& view : views)
    if (usable(view)) view = fitted[next++];
}

/// Median of chi2 with this many degrees of freedom (Wilson and Hilferty, 1931).
double median_of_chi_square(Eigen::Index numbers) {
  const auto n = static_cast<double>(numbers);
  return n * std::pow(1 - 2 / (9 * n), 3);
}

/// Typical ratio of actual to stated noise, robustly estimated from the median over the marks used.
double usual_noise_scale(const std::vector<TargetView>& views, const CameraModel& camera) {
  std::vector<double> all;
  for (const TargetView& view : views)
    for (const ViewMark& mark : view.marks)
      if (const auto chi2 = mark_chi2(mark, view, camera); mark.used && chi2)
        all.push_back(*chi2 / median_of_chi_square(mark.numbers()));
  return all.empty() ? 1 : std::sqrt(median(std::move(all)));
}

void exclude_outliers(std::vector<TargetView>& views, const CameraModel& camera, double gate_sigma) {
  const double usual = usual_noise_scale(views, camera);
  for (TargetView& view : views) {
    for (ViewMark& mark : view.marks) {
      const auto chi2 = mark_chi2(mark, view, camera);
      const auto numbers = static_cast<double>(mark.numbers());
      mark.used = chi2 && *chi2 <= numbers * gate_sigma * gate_sigma * usual * usual;
    }
  }
}

/// Estimates simple distortion first, then one more coefficient, then all of them. If all were estimated from
/// a poor start, the higher powers could bend rays back into the image, which no real lens does.
std::optional<IntrinsicsFit> fit_in_stages(std::vector<TargetView>& views, const Eigen::VectorXd& parameters,
                                           FitOptions options) {
  constexpr int kAll = 1000;
  std::optional<IntrinsicsFit> fit(IntrinsicsFit{.parameters = parameters});
  for (const int free : {4, 5, 6, 8, kAll}) {
    options.free_parameters = free;
    if (free < kAll && free >= parameters.size()) continue;
    fit = fit_intrinsics(views, fit->parameters, options);
    if (!fit) return std::nullopt;
  }
  return fit;
}

Result<IntrinsicsFit> fit_all(Search& search, double gate_sigma) {
  std::vector<TargetView> views = usable_views(search.views);
  if (views.size() < kMinUsableViews)
    return fail(
        ErrorCode::InvalidArgument,
        fmt::format("{} of {} images show two tags of the target or eight corners of a board; {} are needed",
                    views.size(), search.views.size(), kMinUsableViews),
        {}, "Take at least three images of the board; fifteen from all sides are better.");
  const auto failed = [] {
    return fail(ErrorCode::InvalidArgument, "no camera fits these images", {},
                "Check the description of the target: size, spacing, columns, rows, tag numbers, flatness.");
  };
  auto fit = fit_in_stages(views, search.parameters, search.fit);
  if (!fit) return failed();
  restore_frames(views, search.views);
  auto camera = camera_of(search.fit.lens, fit->parameters, search.fit.width_px, search.fit.height_px);
  if (!camera) return tl::unexpected(camera.error());
  find_better_poses(search, {search.fit.lens, fit->parameters, *camera});
  views = usable_views(search.views);
  fit = fit_intrinsics(views, fit->parameters, search.fit);
  if (!fit) return failed();
  restore_frames(views, search.views);
  camera = camera_of(search.fit.lens, fit->parameters, search.fit.width_px, search.fit.height_px);
  if (!camera) return tl::unexpected(camera.error());
  exclude_outliers(search.views, *camera, gate_sigma);
  views = usable_views(search.views);
  FitOptions whole = search.fit;
  whole.huber_sigma = 0;
  if (views.size() < kMinUsableViews) return failed();
  fit = fit_intrinsics(views, fit->parameters, whole);
  if (!fit || fit->information.size() == 0) return failed();
  restore_frames(views, search.views);
  search.parameters = fit->parameters;
  return *fit;
}

double square(double x) { return x * x; }

/// Cross-validation. Leaves out each group of images in turn, fits the others, and predicts the group that
/// was left out, estimating only its poses.
std::optional<double> held_out_rms_px(const Search& fitted, int folds) {
  const std::vector<TargetView> views = usable_views(fitted.views);
  const std::size_t groups = std::min<std::size_t>(static_cast<std::size_t>(folds), views.size());
  FitOptions options = fitted.fit;
  options.huber_sigma = 0;
  std::vector<double> squares;
  for (std::size_t group = 0; group < groups; ++group) {
    std::vector<TargetView> kept;
    std::vector<TargetView> left_out;
    for (std::size_t i = 0; i < views.size(); ++i)
      (i % groups == group ? left_out : kept).push_back(views[i]);
    const auto fit = fit_intrinsics(kept, fitted.parameters, options);
    if (!fit) return std::nullopt;
    FitOptions poses_only = options;
    poses_only.free_parameters = 0;
    const auto camera = camera_of(options.lens, fit->parameters, options.width_px, options.height_px);
    if (!camera || !fit_intrinsics(left_out, fit->parameters, poses_only)) return std::nullopt;
    for (const TargetView& view : left_out)
      for (const double value : squared_distances_px2(view, *camera)) squares.push_back(value);
  }
  return root_mean(squares);
}

Result<CameraCalibration> result_of(const Search& search, const IntrinsicsFit& fit) {
  auto camera = camera_of(search.fit.lens, fit.parameters, search.fit.width_px, search.fit.height_px);
  if (!camera) return tl::unexpected(camera.error());
  CameraCalibration found{.camera = *camera,
                          .lens = search.fit.lens,
                          .names = parameter_names(search.fit.lens),
                          .parameters = fit.parameters};
  double numbers = 0;
  std::vector<double> squares;
  for (const TargetView& view : search.views) {
    found.views.push_back(summary_of(view, *camera));
    for (const ViewMark& mark : view.marks) numbers += mark.used ? static_cast<double>(mark.numbers()) : 0;
    for (const double value : squared_distances_px2(view, *camera)) squares.push_back(value);
  }
  const auto free = numbers - static_cast<double>(fit.parameters.size()) -
                    6 * static_cast<double>(usable_views(search.views).size());
  if (!(free > 0))
    return fail(ErrorCode::InvalidArgument, "fewer corners than unknowns", {}, "Take more images.");
  found.noise_scale = std::sqrt(fit.chi2 / free);
  const Eigen::Index n = fit.parameters.size();
  const SymmetricSolution inverse = solve_symmetric(fit.information, Eigen::MatrixXd::Identity(n, n));
  if (!inverse.positive)
    return fail(ErrorCode::InvalidArgument, "the images do not determine the camera parameters", {},
                "Take images of the target from more sides.");
  found.covariance = square(found.noise_scale) * inverse.X;
  found.rms_px = root_mean(squares);
  found.regions = regions_of(search.views, *camera);
  return found;
}

Result<CameraCalibration> calibrate_with(Search search, LensModel lens,
                                         const CameraCalibrationOptions& options) {
  if (const Status begun = begin_search(search, lens); !begun) return tl::unexpected(begun.error());
  const Result<IntrinsicsFit> fit = fit_all(search, options.gate_sigma);
  if (!fit) return tl::unexpected(fit.error());
  Result<CameraCalibration> found = result_of(search, *fit);
  if (!found) return found;
  const auto held_out = held_out_rms_px(search, options.folds);
  if (!held_out)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the images do not determine a lens '{}' in cross-validation", to_string(lens)),
                {}, "Take more images, or use a lens model with fewer parameters.");
  found->held_out_rms_px = *held_out;
  found->advice = internal::calibration_causes(search.views, search.fit, found->parameters);
  return found;
}

/// Calibrates with the given lens model or, if none is given, with the candidate that has the fewest
/// parameters among those with nearly the smallest cross-validation error.
Result<CameraCalibration> calibrate(const Search& search, std::optional<LensModel> lens,
                                    const CameraCalibrationOptions& options) {
  const std::vector<LensModel>& choice = options.lenses.empty() ? lens_models() : options.lenses;
  const std::vector<LensModel> lenses = lens ? std::vector{*lens} : choice;
  std::vector<CameraCalibration> found;
  std::vector<LensTrial> trials;
  std::optional<Error> error;
  double best = std::numeric_limits<double>::infinity();
  for (const LensModel trial : lenses) {
    if (!options.goes_on()) return fail(ErrorCode::NotFound, "the calibration was stopped");
    Result<CameraCalibration> result = calibrate_with(search, trial, options);
    trials.push_back({trial, result ? std::optional(result->held_out_rms_px) : std::nullopt});
    if (!result) {
      if (!error) error = result.error();
      continue;
    }
    best = std::min(best, result->held_out_rms_px);
    found.push_back(std::move(*result));
  }
  if (found.empty()) return tl::unexpected(*error);
  const auto chosen = std::ranges::find_if(found, [&](const CameraCalibration& one) {
    return one.held_out_rms_px <= (1 + options.better_by) * best;
  });
  constexpr double kMaxNoiseScale = 10;
  if (chosen->noise_scale > kMaxNoiseScale)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the corner residuals are {:.0f} times larger than their covariances",
                            chosen->noise_scale),
                {},
                "The target does not match its description. Check columns and rows, sizes, spacing, first "
                "number, and "
                "that the board is flat.");
  chosen->trials = trials;
  const std::vector<std::string> more = internal::calibration_advice(*chosen);
  chosen->advice.insert(chosen->advice.end(), more.begin(), more.end());
  return *chosen;
}

/// The matrix is exactly symmetric with ones on its diagonal. Empty if a variance is not positive.
Eigen::MatrixXd correlations_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd variance = covariance.diagonal();
  if (variance.size() == 0 || !(variance.minCoeff() > 0)) return {};
  const Eigen::VectorXd inverse_sigma = variance.cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd R =
      inverse_sigma.asDiagonal() * (covariance + covariance.transpose()) / 2 * inverse_sigma.asDiagonal();
  for (Eigen::Index i = 0; i < R.rows(); ++i) {
    R(i, i) = 1;
    for (Eigen::Index j = 0; j < i; ++j) R(i, j) = R(j, i) = std::clamp(R(i, j), -1.0, 1.0);
  }
  return R;
}

}  // namespace

Result<CameraCalibration> calibrate_camera(const std::vector<std::vector<TagDetection>>& images,
                                           const TagMap& target, int width_px, int height_px,
                                           std::optional<LensModel> lens,
                                           const CameraCalibrationOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  std::vector<TargetMarks> marks;
  marks.reserve(images.size());
  for (const auto& detections : images) marks.push_back(target_marks(detections, target));
  auto views = views_of(marks, options.corner_sigma_px);
  if (!views) return tl::unexpected(views.error());
  return calibrate({.start = internal::start_from_tags(images, target),
                    .fit = {.width_px = width_px, .height_px = height_px, .goes_on = options.goes_on},
                    .views = *std::move(views)},
                   lens, options);
}

Result<CameraCalibration> calibrate_camera(const std::vector<TargetMarks>& images, int width_px,
                                           int height_px, std::optional<LensModel> lens,
                                           const CameraCalibrationOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  const auto views = views_of(images, options.corner_sigma_px);
  if (!views) return tl::unexpected(views.error());
  return calibrate({.start = internal::start_from_plane(*views),
                    .fit = {.width_px = width_px, .height_px = height_px, .goes_on = options.goes_on},
                    .views = *views},
                   lens, options);
}

Calibration to_calibration(const CameraCalibration& found) {
  constexpr double kMaxFocalShareSigma = 0.02;
  Calibration calibration{.camera = found.camera};
  for (std::size_t i = 0; i < found.names.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    CalibratedValue value{.value = found.parameters[k],
                          .sigma = std::sqrt(std::max(0.0, found.covariance(k, k)))};
    if (i < 4 && value.sigma > kMaxFocalShareSigma * found.parameters[0]) {
      value.verdict = CalibrationVerdict::Unobservable;
      value.advice = "Take images with the board tilted to the left, right, up and down.";
    }
    calibration.values[found.names[i]] = value;
  }
  calibration.camera_correlations = correlations_of(found.covariance);
  calibration.provenance = {{"lens", std::string(to_string(found.lens))},
                            {"rms_px", fmt::format("{:.4f}", found.rms_px)},
                            {"held_out_rms_px", fmt::format("{:.4f}", found.held_out_rms_px)}};
  return calibration;
}

}  // namespace waymark
