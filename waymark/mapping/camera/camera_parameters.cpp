#include "waymark/mapping/camera/camera_parameters.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace waymark {
namespace {

constexpr std::array<std::pair<LensModel, std::string_view>, 5> kLenses = {
    {{LensModel::None, "none"},
     {LensModel::Radtan4, "radtan4"},
     {LensModel::Radtan5, "radtan5"},
     {LensModel::Rational8, "rational8"},
     {LensModel::Equidistant, "equidistant"}}};
constexpr int kPinholeParameters = 4;

int coefficients_of(LensModel lens) {
  switch (lens) {
    case LensModel::None:
      return 0;
    case LensModel::Radtan4:
    case LensModel::Equidistant:
      return 4;
    case LensModel::Radtan5:
      return 5;
    case LensModel::Rational8:
      return 8;
  }
  return 0;
}

}  // namespace

std::string_view to_string(LensModel lens) {
  for (const auto& [known, name] : kLenses)
    if (known == lens) return name;
  return "";
}

std::optional<LensModel> lens_model(std::string_view word) {
  for (const auto& [lens, name] : kLenses)
    if (name == word) return lens;
  return std::nullopt;
}

const std::vector<LensModel>& lens_models() {
  static const std::vector<LensModel> all = [] {
    std::vector<LensModel> lenses;
    for (const auto& [lens, name] : kLenses) lenses.push_back(lens);
    return lenses;
  }();
  return all;
}

std::vector<std::string> parameter_names(LensModel lens) {
  static const std::vector<std::string> radtan = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  static const std::vector<std::string> fisheye = {"k1", "k2", "k3", "k4"};
  std::vector<std::string> names = {"fx_px", "fy_px", "cx_px", "cy_px"};
  const auto& all = lens == LensModel::Equidistant ? fisheye : radtan;
  names.insert(names.end(), all.begin(), all.begin() + coefficients_of(lens));
  return names;
}

namespace {

Result<CameraModel> checked(const Result<CameraModel>& camera) {
  if (!camera || camera->reaches_an_edge()) return camera;
  return fail(ErrorCode::InvalidArgument, "the distortion folds before the nearest image edge",
              {.key = "distortion"}, "Take views that reach the edges of the image.");
}

}  // namespace

Result<CameraModel> camera_of(LensModel lens, const Eigen::VectorXd& p, int width_px, int height_px) {
  const int coefficients = coefficients_of(lens);
  if (lens == LensModel::Equidistant) {
    Equidistant fisheye{.fx = p[0], .fy = p[1], .cx = p[2], .cy = p[3]};
    for (int i = 0; i < coefficients; ++i) fisheye.k[static_cast<std::size_t>(i)] = p[kPinholeParameters + i];
    return checked(CameraModel::make(fisheye, width_px, height_px));
  }
  PinholeRadtan pinhole{
      .fx = p[0], .fy = p[1], .cx = p[2], .cy = p[3], .k = {}, .coefficients = coefficients};
  for (int i = 0; i < coefficients; ++i) pinhole.k[static_cast<std::size_t>(i)] = p[kPinholeParameters + i];
  return checked(CameraModel::make(pinhole, width_px, height_px));
}

}  // namespace waymark
