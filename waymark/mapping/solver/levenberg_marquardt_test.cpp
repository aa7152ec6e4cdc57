// Tests the search on problems with known solutions.
#include "waymark/mapping/solver/levenberg_marquardt.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

namespace waymark::internal {
namespace {

const auto kGoesOn = [](int, double) { return true; };

/// Residuals that depend on a few unknowns, with a dense Jacobian.
template <class Values>
class Dense {
 public:
  explicit Dense(const Values& start) : x_(start) {}
  virtual ~Dense() = default;
  [[nodiscard]] virtual Eigen::VectorXd residual(const Values& x) const = 0;
  [[nodiscard]] virtual Eigen::MatrixXd jacobian(const Values& x) const = 0;

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
  [[nodiscard]] Values values() const { return x_; }
  void restore(const Values& x) { x_ = x; }

 private:
  Values x_;
  Eigen::MatrixXd H_{};
  Eigen::VectorXd g_{};
};

using Plane = Dense<Eigen::Vector2d>;

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

/// A function that is undefined beyond x = 0, where the first full step leads.
struct FlatWall : Plane {
  using Plane::Plane;
  [[nodiscard]] Eigen::VectorXd residual(const Eigen::Vector2d& x) const override {
    return Eigen::Vector2d(std::log(x.x()) + 3, x.y());
  }
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::Vector2d& x) const override {
    return Eigen::Vector2d(1 / x.x(), 1).asDiagonal();
  }
};

/// The gradient has the wrong sign, so no step of any length reduces the cost.
struct WrongSlope : Line {
  using Line::Line;
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::Vector2d& x) const override {
    return -Line::jacobian(x);
  }
};

/// A path with a measured start and a measured curvature at each point; its far end depends on all
/// measurements.
struct CurvedPath : Dense<Eigen::VectorXd> {
  using Dense::Dense;
  [[nodiscard]] Eigen::VectorXd residual(const Eigen::VectorXd& x) const override {
    Eigen::VectorXd r(x.size());
    r.head<2>() << x[0], x[1] - x[0] - 0.5;
    for (Eigen::Index i = 2; i < x.size(); ++i) r[i] = x[i] - 2 * x[i - 1] + x[i - 2] - 1;
    return r;
  }
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& x) const override {
    Eigen::MatrixXd J = Eigen::MatrixXd::Identity(x.size(), x.size());
    J(1, 0) = -1;
    for (Eigen::Index i = 2; i < x.size(); ++i) {
      J(i, i - 1) = -2;
      J(i, i - 2) = 1;
    }
    return J;
  }
};

TEST(LevenbergMarquardt, ALongPathTakesNoMoreStepsThanAShortOne) {
  for (const Eigen::Index length : {10, 100, 300}) {
    CurvedPath path(Eigen::VectorXd::Zero(length));
    const auto end = levenberg_marquardt(path, path.linearize(), {}, kGoesOn);
    EXPECT_TRUE(end.converged) << length;
    EXPECT_LE(end.iterations, 6) << length;
    const auto last = static_cast<double>(length - 1);
    EXPECT_NEAR(path.values()[length - 1], last * last / 2, 1e-6 * last * last) << length;
  }
}

TEST(LevenbergMarquardt, DampingDecreasesWhileStepsGainWhatTheModelPredicts) {
  Damping damping(1e-3);
  damping.after_gain(1, 1);
  EXPECT_NEAR(damping.value(), 1e-6, 1e-12);
  damping.after_gain(0.5, 1);
  EXPECT_NEAR(damping.value(), 1e-7, 1e-13);
  damping.after_gain(0.1, 1);
  EXPECT_NEAR(damping.value(), 1e-7, 1e-13);
  for (int i = 0; i < 100; ++i) damping.after_gain(1, 1);
  EXPECT_GT(damping.value(), 0);
}

TEST(LevenbergMarquardt, DampingIncreasesByGrowingFactors) {
  Damping damping(0);
  int failures = 0;
  for (double before = 0; !damping.exhausted(); before = damping.value(), ++failures) {
    damping.after_failure();
    EXPECT_GT(damping.value(), before);
    ASSERT_LT(failures, 20);
  }
  EXPECT_LE(failures, 8);
}

TEST(LevenbergMarquardt, ALinearProblemTakesAtMostTwoSteps) {
  Line line({50, -70});
  const auto end = levenberg_marquardt(line, line.linearize(), {.damping = 0}, kGoesOn);
  EXPECT_TRUE(end.converged);
  EXPECT_LE(end.iterations, 2);
  EXPECT_LT((line.values() - Eigen::Vector2d(5.0 / 6, 1.5)).norm(), 1e-9);
}

/// Properties that hold with and without the watchdog step.
class Search : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(LevenbergMarquardt, Search, ::testing::Bool(),
                         [](const auto& watchdog) { return watchdog.param ? "Watchdog" : "Backtracking"; });

TEST_P(Search, FollowsACurvedValleyToItsEnd) {
  for (const Eigen::Vector2d& start : std::vector<Eigen::Vector2d>{{-1.2, 1}, {0, 0}, {8, -30}}) {
    Valley valley(start);
    const auto end = levenberg_marquardt(valley, valley.linearize(), {.watchdog = GetParam()}, kGoesOn);
    EXPECT_TRUE(end.converged);
    EXPECT_LT((valley.values() - Eigen::Vector2d(1, 1)).norm(), 1e-6);
    EXPECT_DOUBLE_EQ(end.cost, valley.cost());
  }
}

TEST_P(Search, NoStepRaisesTheCost) {
  for (const Eigen::Vector2d& start : std::vector<Eigen::Vector2d>{{-1.2, 1}, {0.88, 0.7744}}) {
    Valley valley(start);
    double last = valley.linearize();
    const auto watch = [&](int, double cost) {
      EXPECT_LE(cost, last);
      last = cost;
      return true;
    };
    EXPECT_LE(levenberg_marquardt(valley, last, {.watchdog = GetParam()}, watch).cost, last);
  }
}

TEST_P(Search, RecoversFromAStepToAnInfiniteCost) {
  FlatWall wall({20, 5});
  const auto end = levenberg_marquardt(wall, wall.linearize(), {.watchdog = GetParam()}, kGoesOn);
  EXPECT_TRUE(end.converged);
  EXPECT_NEAR(wall.values().x(), std::exp(-3), 1e-6);
}

TEST_P(Search, KeepsItsValuesIfNoStepReducesTheCost) {
  WrongSlope wrong({50, -70});
  const double start = wrong.linearize();
  const auto end =
      levenberg_marquardt(wrong, start, {.max_iterations = 1000, .watchdog = GetParam()}, kGoesOn);
  EXPECT_TRUE(end.converged || end.exhausted);
  EXPECT_LT(end.iterations, 100);
  EXPECT_DOUBLE_EQ(end.cost, start);
  EXPECT_EQ(wrong.values(), Eigen::Vector2d(50, -70));
}

/// A step along the valley floor leaves it by a second-order distance, and the next step returns to it.
TEST(LevenbergMarquardt, TheWatchdogStepCorrectsSecondOrderErrors) {
  const auto steps = [](bool watchdog) {
    Valley valley({0.88, 0.7744});
    const auto end =
        levenberg_marquardt(valley, valley.linearize(), {.damping = 0, .watchdog = watchdog}, kGoesOn);
    EXPECT_TRUE(end.converged);
    EXPECT_LT((valley.values() - Eigen::Vector2d(1, 1)).norm(), 1e-6);
    return end.iterations;
  };
  EXPECT_GT(steps(false), 3);
  EXPECT_LE(steps(true), 2);
}

TEST(LevenbergMarquardt, StopsOnRequestAndAtMaxIterations) {
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
