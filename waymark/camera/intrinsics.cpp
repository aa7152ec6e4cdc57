#include "waymark/camera/intrinsics.hpp"

#include <cmath>
#include <variant>

#include <Eigen/Cholesky>

namespace waymark {
namespace {

constexpr int kPinhole = 4;  // fx, fy, cx, cy

int coefficients_of(const PinholeRadtan& model) { return model.coefficients; }
int coefficients_of(const Equidistant& model) { return static_cast<int>(model.k.size()); }

/// Derivatives, with respect to each coefficient, of the point where a ray meets the image plane at unit
/// focal length.
using Bend = Eigen::Matrix<double, 2, 8>;

/// Derivatives of Radtan::distort().
Bend bend_of(const PinholeRadtan& model, const Eigen::Vector3d& cam_p) {
  const Eigen::Vector2d p = cam_p.head<2>() / cam_p.z();
  const auto& k = model.k;
  const double s = p.squaredNorm();
  const double over = 1 + s * (k[0] + s * (k[1] + s * k[4]));
  const double under = 1 + s * (k[5] + s * (k[6] + s * k[7]));
  const double less = -over / (under * under);
  const double cross = 2 * p.x() * p.y();
  Bend J;
  J.col(0) = p * s / under;
  J.col(1) = p * s * s / under;
  J.col(2) << cross, s + 2 * p.y() * p.y();
  J.col(3) << s + 2 * p.x() * p.x(), cross;
  J.col(4) = p * s * s * s / under;
  J.col(5) = p * s * less;
  J.col(6) = p * s * s * less;
  J.col(7) = p * s * s * s * less;
  return J;
}

/// Derivatives of EquidistantAngle::distort().
Bend bend_of(const Equidistant& /*model*/, const Eigen::Vector3d& cam_p) {
  const double radius = cam_p.head<2>().norm();
  const double angle = std::atan2(radius, cam_p.z());
  const Eigen::Vector2d direction =
      radius > 0 ? Eigen::Vector2d(cam_p.head<2>() / radius) : Eigen::Vector2d(Eigen::Vector2d::Zero());
  Bend J = Bend::Zero();
  for (int i = 0; i < 4; ++i) J.col(i) = direction * std::pow(angle, 2 * i + 3);
  return J;
}

}  // namespace

Eigen::VectorXd intrinsics_of(const CameraModel& camera) {
  return std::visit(
      [](const auto& model) {
        Eigen::VectorXd numbers(kPinhole + coefficients_of(model));
        numbers.head<kPinhole>() << model.fx, model.fy, model.cx, model.cy;
        for (int i = 0; i < coefficients_of(model); ++i)
          numbers[kPinhole + i] = model.k[static_cast<std::size_t>(i)];
        return numbers;
      },
      camera.projection());
}

std::vector<std::string> intrinsics_names(const CameraModel& camera) {
  std::vector<std::string> names = {"fx", "fy", "cx", "cy"};
  const std::vector<std::string> radtan = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  const std::vector<std::string> fisheye = {"k1", "k2", "k3", "k4"};
  const auto& all = std::holds_alternative<Equidistant>(camera.projection()) ? fisheye : radtan;
  const auto more = static_cast<std::ptrdiff_t>(intrinsics_of(camera).size()) - kPinhole;
  names.insert(names.end(), all.begin(), all.begin() + more);
  return names;
}

Result<CameraModel> with_intrinsics(const CameraModel& camera, const Eigen::VectorXd& intrinsics) {
  CameraModel::Projection projection = camera.projection();
  std::visit(
      [&](auto& model) {
        model.fx = intrinsics[0];
        model.fy = intrinsics[1];
        model.cx = intrinsics[2];
        model.cy = intrinsics[3];
        for (int i = 0; i < coefficients_of(model); ++i)
          model.k[static_cast<std::size_t>(i)] = intrinsics[kPinhole + i];
      },
      projection);
  return CameraModel::make(projection, camera.width_px(), camera.height_px());
}

bool is_covariance(const IntrinsicsCovariance& covariance) {
  constexpr double kRounding = 1e-9;  // of a correlation
  const Eigen::Index n = covariance.rows();
  if (n == 0 || covariance.cols() != n || !covariance.allFinite() || covariance.diagonal().minCoeff() < 0)
    return false;
  IntrinsicsCovariance correlations = covariance;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double scale = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
      if (scale > 0) correlations(i, j) /= scale;
    }
  }
  if ((correlations - correlations.transpose()).cwiseAbs().maxCoeff() > kRounding) return false;
  correlations.diagonal().array() += kRounding;
  return Eigen::LLT<IntrinsicsCovariance>(correlations).info() == Eigen::Success;
}

std::optional<IntrinsicsJacobian> intrinsics_jacobian(const CameraModel& camera,
                                                      const Eigen::Vector3d& cam_p) {
  const auto px = camera.project(cam_p);
  if (!px) return std::nullopt;
  return std::visit(
      [&](const auto& model) {
        const int n = coefficients_of(model);
        IntrinsicsJacobian J = IntrinsicsJacobian::Zero(2, kPinhole + n);
        const double y = (px->y() - model.cy) / model.fy;
        J(0, 0) = (px->x() - model.cx - model.skew * y) / model.fx;
        J(1, 1) = y;
        J(0, 2) = J(1, 3) = 1;
        const Bend bend = bend_of(model, cam_p);
        J.row(0).tail(n) = model.fx * bend.row(0).head(n) + model.skew * bend.row(1).head(n);
        J.row(1).tail(n) = model.fy * bend.row(1).head(n);
        return J;
      },
      camera.projection());
}

}  // namespace waymark
