#include "waymark/evaluation/alignment.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace waymark {
namespace {

using Positions = Eigen::Matrix<double, 3, Eigen::Dynamic>;
constexpr std::array<std::pair<AlignmentKind, std::string_view>, 4> kAlignmentNames = {
    {{AlignmentKind::None, "none"},
     {AlignmentKind::Se2, "se2"},
     {AlignmentKind::Se3, "se3"},
     {AlignmentKind::Sim3, "sim3"}}};

/// How far the positions spread along their second widest direction [m], in the floor plane for se2 along the
/// widest: without it a rotation cannot be told.
double decisive_spread_m(const Positions& p, AlignmentKind kind) {
  Positions centred = p.colwise() - p.rowwise().mean();
  if (kind == AlignmentKind::Se2) centred.row(2).setZero();
  const Eigen::Matrix3d scatter = centred * centred.transpose() / static_cast<double>(p.cols());
  const Eigen::Vector3d variances = Eigen::JacobiSVD<Eigen::Matrix3d>(scatter).singularValues();
  return std::sqrt(variances[kind == AlignmentKind::Se2 ? 0 : 1]);
}

Alignment align_in_plane(const Positions& estimated, const Positions& reference) {
  const Eigen::Matrix3d fit =
      Eigen::umeyama(estimated.topRows<2>().eval(), reference.topRows<2>().eval(), false);
  const double yaw_rad = std::atan2(fit(1, 0), fit(0, 0));
  return {1, SE3(SO3::exp({0, 0, yaw_rad}), {fit(0, 2), fit(1, 2), 0})};
}

Alignment align_in_space(const Positions& estimated, const Positions& reference, bool with_scale) {
  const Eigen::Matrix4d fit = Eigen::umeyama(estimated, reference, with_scale);
  const double scale = fit.topLeftCorner<3, 1>().norm();
  const Eigen::Matrix3d rotation = fit.topLeftCorner<3, 3>() / scale;
  return {scale, SE3(SO3::from_matrix(rotation), fit.topRightCorner<3, 1>())};
}

}  // namespace

std::string_view to_string(AlignmentKind kind) {
  for (const auto& [known, name] : kAlignmentNames)
    if (known == kind) return name;
  return "";
}

std::optional<AlignmentKind> alignment_kind(std::string_view word) {
  for (const auto& [kind, name] : kAlignmentNames)
    if (name == word) return kind;
  return std::nullopt;
}

Result<Alignment> align(const std::vector<PosePair>& pairs, AlignmentKind kind) {
  constexpr std::size_t kFewestPairs = 3;
  constexpr double kLeastSpread = 1e-3;
  if (kind == AlignmentKind::None) return Alignment{};
  if (pairs.size() < kFewestPairs)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} poses at the same time as the reference: too few to align", pairs.size()));
  Positions estimated(3, static_cast<Eigen::Index>(pairs.size()));
  Positions reference(3, estimated.cols());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    estimated.col(static_cast<Eigen::Index>(i)) = pairs[i].estimated.map_T_base.translation();
    reference.col(static_cast<Eigen::Index>(i)) = pairs[i].reference.translation();
  }
  if (decisive_spread_m(estimated, kind) < kLeastSpread || decisive_spread_m(reference, kind) < kLeastSpread)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the positions spread too little to align by {}", to_string(kind)), {},
                kind == AlignmentKind::Se2 ? "Judge a longer drive, or do not align."
                                           : "They lie on a line: align by se2, or not at all.");
  return kind == AlignmentKind::Se2 ? align_in_plane(estimated, reference)
                                    : align_in_space(estimated, reference, kind == AlignmentKind::Sim3);
}

}  // namespace waymark
