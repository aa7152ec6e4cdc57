// The search on problems whose answer is known.
#include "waymark/mapping/optimization/levenberg_marquardt.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

namespace waymark::internal {
namespace {

const auto kGoesOn = [](int, double) { return true; };

/// Residuals of two unknowns with a dense Jacobian.
class Plane {
 public:
  explicit Plane(const Eigen::Vector2d& start) : x_(start) {}
  virtual ~Plane() = default;
  [[nodiscard]] virtual Eigen::VectorXd residual(const Eigen::Vector2d& x) const = 0;
  [[nodiscard]] virtual Eigen::MatrixXd jacobian(const Eigen::Vector2d& x) const = 0;

  double linearize() {
    const Eigen::MatrixXd J = jacobian(x_);
    H_ = J.transpose() * J;
    g_ = J.transpose() * residual(x_);
    return cost();
  }
  [[nodiscard]] double cost() const {
    const double chi2 = residual(x_).squaredNorm();
    return std::isfinite(chi2) ? chi2 / 2 : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return g_; }
  std::optional<Eigen::VectorXd> damped_step(double damping) {
    Eigen::MatrixXd H = H_;
    H.diagonal() *= 1 + damping;
    const Eigen::LLT<Eigen::MatrixXd> llt(H);
    if (llt.info() != Eigen::Success) return std::nullopt;
    return Eigen::VectorXd(-llt.solve(g_));
  }
  void retract(const Eigen::VectorXd& step) { x_ += step; }
  [[nodiscard]] Eigen::Vector2d values() const { return x_; }
  void restore(const Eigen::Vector2d& x) { x_ = x; }

 private:
  Eigen::Vector2d x_;
  Eigen::MatrixXd H_{};
  Eigen::VectorXd g_{};
};

struct Line : Plane {
  using Plane::Plane;
  [[nodiscard]] Eigen::VectorXd residual(const Eigen::Vector2d& x) const override {
    return Line::jacobian(x) * x - Eigen::Vector3d(1, 2, 4);
  }
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::Vector2d& /*x*/) const override {
    Eigen::MatrixXd J(3, 2);
    J << 1, 0, 1, 1, 1, 2;
    return J;
  }
};

/// Rosenbrock, "An Automatic Method for Finding the Greatest or Least Value of a Function", 1960.
struct Valley : Plane {
  using Plane::Plane;
  [[nodiscard]] Eigen::VectorXd residual(const Eigen::Vector2d& x) const override {
    return Eigen::Vector2d(10 * (x.y() - x.x() * x.x()), 1 - x.x());
  }
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::Vector2d& x) const override {
    Eigen::Matrix2d J;
    J << -20 * x.x(), 10, -1, 0;
    return J;
  }
};

/// Has no value beyond x = 0, and its first full step leads there.
struct Wall : Plane {
  using Plane::Plane;
  [[nodiscard]] Eigen::VectorXd residual(const Eigen::Vector2d& x) const override {
    return Eigen::Vector2d(std::log(x.x()) + 3, x.y());
  }
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::Vector2d& x) const override {
    return Eigen::Vector2d(1 / x.x(), 1).asDiagonal();
  }
};

/// Its slope points the wrong way: no step of any length gains anything.
struct WrongSlope : Line {
  using Line::Line;
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::Vector2d& x) const override {
    return -Line::jacobian(x);
  }
};

TEST(LevenbergMarquardt, ALinearProblemTakesOneStepAndOneThatGainsNothing) {
  Line line({50, -70});
  const auto end = levenberg_marquardt(line, line.linearize(), {.damping = 0}, kGoesOn);
  EXPECT_TRUE(end.converged);
  EXPECT_LE(end.iterations, 2);
  EXPECT_LT((line.values() - Eigen::Vector2d(5.0 / 6, 1.5)).norm(), 1e-9);
}

TEST(LevenbergMarquardt, FollowsACurvedValleyToItsEnd) {
  for (const Eigen::Vector2d& start : std::vector<Eigen::Vector2d>{{-1.2, 1}, {0, 0}, {8, -30}}) {
    Valley valley(start);
    const auto end = levenberg_marquardt(valley, valley.linearize(), {}, kGoesOn);
    EXPECT_TRUE(end.converged);
    EXPECT_LT((valley.values() - Eigen::Vector2d(1, 1)).norm(), 1e-6);
    EXPECT_DOUBLE_EQ(end.cost, valley.cost());
  }
}

TEST(LevenbergMarquardt, NoStepRaisesTheCost) {
  Valley valley({-1.2, 1});
  double last = valley.linearize();
  const auto watch = [&](int, double cost) {
    EXPECT_LE(cost, last);
    last = cost;
    return true;
  };
  EXPECT_LE(levenberg_marquardt(valley, last, {}, watch).cost, last);
}

TEST(LevenbergMarquardt, ComesBackFromWhereTheCostHasNoValue) {
  Wall wall({20, 5});
  const auto end = levenberg_marquardt(wall, wall.linearize(), {}, kGoesOn);
  EXPECT_TRUE(end.converged);
  EXPECT_NEAR(wall.values().x(), std::exp(-3), 1e-6);
}

TEST(LevenbergMarquardt, StaysWhereItIsWhenNothingGains) {
  WrongSlope wrong({50, -70});
  const double start = wrong.linearize();
  const auto end = levenberg_marquardt(wrong, start, {.max_iterations = 1000}, kGoesOn);
  EXPECT_TRUE(end.converged || end.exhausted);
  EXPECT_LT(end.iterations, 100);
  EXPECT_DOUBLE_EQ(end.cost, start);
  EXPECT_EQ(wrong.values(), Eigen::Vector2d(50, -70));
}

TEST(LevenbergMarquardt, StopsOnRequestAndAtItsMostSteps) {
  Valley valley({-1.2, 1});
  const auto twice = [](int iteration, double) { return iteration < 2; };
  const auto stopped = levenberg_marquardt(valley, valley.linearize(), {}, twice);
  EXPECT_TRUE(stopped.stopped);
  EXPECT_EQ(stopped.iterations, 2);
  Valley other({-1.2, 1});
  const auto ended = levenberg_marquardt(other, other.linearize(), {.max_iterations = 3}, kGoesOn);
  EXPECT_FALSE(ended.stopped || ended.converged);
  EXPECT_EQ(ended.iterations, 3);
}

}  // namespace
}  // namespace waymark::internal
