// The laws of a Lie group and of its tangent, for every group in the same words.
#include "waymark/geometry/lie.hpp"

#include <gtest/gtest.h>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/geometry_samples.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se23.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/so2.hpp"
#include "waymark/geometry/so3.hpp"

namespace waymark {
namespace {

using testing::critical_tangents;
using testing::GroupNear;
using testing::MatrixNear;
using testing::random_element;

static_assert(LieGroup<SO2> && LieGroup<SE2> && LieGroup<SO3> && LieGroup<SE3> && LieGroup<SE23>);

template <class G>
class LieLaws : public ::testing::Test {
 public:
  const std::vector<typename G::Tangent> xs = critical_tangents<G>(1), ys = critical_tangents<G>(2),
                                         zs = critical_tangents<G>(3);

  /// Rounding is relative to the longest translation involved.
  static double tolerance(const typename G::Tangent& xi, double factor) { return factor * (1 + xi.norm()); }
};

class GroupNames {
 public:
  template <class G>
  static std::string GetName(int) {
    if (std::is_same_v<G, SO2>) return "SO2";
    if (std::is_same_v<G, SE2>) return "SE2";
    if (std::is_same_v<G, SO3>) return "SO3";
    return std::is_same_v<G, SE3> ? "SE3" : "SE23";
  }
};

using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(LieLaws, Groups, GroupNames);

TYPED_TEST(LieLaws, IdentityIsNeutral) {
  using G = TypeParam;
  EXPECT_EQ(G(), G::identity());
  EXPECT_EQ(G::exp(G::Tangent::Zero()), G::identity());
  EXPECT_EQ(G::identity().log(), G::Tangent::Zero());
  EXPECT_EQ(G::identity().matrix(), G::Matrix::Identity());
  for (const auto& xi : this->xs) {
    const G X = G::exp(xi);
    EXPECT_THAT(X * G::identity(), GroupNear(X, this->tolerance(xi, 1e-15)));
    EXPECT_THAT(G::identity() * X, GroupNear(X, this->tolerance(xi, 1e-15)));
  }
}

TYPED_TEST(LieLaws, InverseUndoes) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    const G X = G::exp(xi);
    EXPECT_THAT(X * X.inverse(), GroupNear(G::identity(), this->tolerance(xi, 2e-15)));
    EXPECT_THAT(X.inverse() * X, GroupNear(G::identity(), this->tolerance(xi, 2e-15)));
    EXPECT_THAT(X.inverse().inverse(), GroupNear(X, this->tolerance(xi, 2e-15)));
    EXPECT_THAT(G::exp(-xi), GroupNear(X.inverse(), this->tolerance(xi, 2e-15)));
  }
}

TYPED_TEST(LieLaws, CompositionIsAssociativeAndAProductOfMatrices) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->ys[i]), Z = G::exp(this->zs[i]);
    const double tolerance = this->tolerance(this->xs[i], 1e-15) + this->tolerance(this->ys[i], 1e-15) +
                             this->tolerance(this->zs[i], 1e-15);
    EXPECT_THAT((X * Y) * Z, GroupNear(X * (Y * Z), tolerance));
    EXPECT_THAT((X * Y).matrix(), MatrixNear((X.matrix() * Y.matrix()).eval(), tolerance));
    EXPECT_THAT((X * Y).inverse(), GroupNear(Y.inverse() * X.inverse(), tolerance));
  }
}

TYPED_TEST(LieLaws, LogUndoesExp) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    EXPECT_LE((G::exp(xi).log() - xi).norm(), 1e-14 * xi.norm())
        << xi.transpose();  // all digits, also of 1e-12 rad
  }
}

TYPED_TEST(LieLaws, ExpUndoesLog) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]) * G::exp(this->ys[i]);
    EXPECT_THAT(G::exp(X.log()),
                GroupNear(X, this->tolerance(this->xs[i], 1e-14) + this->tolerance(this->ys[i], 1e-14)));
  }
}

TYPED_TEST(LieLaws, VeeUndoesHatAndHatIsTheDerivativeOfExp) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    EXPECT_EQ(G::vee(G::hat(xi)), xi);
    const auto along = [&](double s) { return G::exp(s * xi).matrix(); };
    EXPECT_THAT(testing::numeric_derivative(along), MatrixNear(G::hat(xi), this->tolerance(xi, 2e-12)));
  }
}

TYPED_TEST(LieLaws, ExpOfMultiplesOfOneTangentAdds) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    EXPECT_THAT(G::exp(0.25 * xi) * G::exp(0.5 * xi),
                GroupNear(G::exp(0.75 * xi), this->tolerance(xi, 2e-15)));
  }
}

TYPED_TEST(LieLaws, AdjointMovesATangentThroughAnElement) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->zs[i]);
    const auto& xi = this->ys[i];
    const double size = (1 + this->xs[i].norm()) * (1 + xi.norm()) * (1 + this->zs[i].norm());
    EXPECT_THAT(X * G::exp(xi) * X.inverse(), GroupNear(G::exp(X.adjoint() * xi), 1e-15 * size));
    EXPECT_THAT((X * Y).adjoint(), MatrixNear((X.adjoint() * Y.adjoint()).eval(), 1e-15 * size));
    const typename G::Matrix commutator = G::hat(this->xs[i]) * G::hat(xi) - G::hat(xi) * G::hat(this->xs[i]);
    EXPECT_THAT((G::ad(this->xs[i]) * xi).eval(), MatrixNear(G::vee(commutator), 1e-15 * size));
  }
}

// The sentence of docs/conventions.md: translation first, then rotation; X = Exp(xi) X_hat with xi in the
// parent frame; corrections add.
TYPED_TEST(LieLaws, CorrectionsAreInTheParentFrameAndAdd) {
  using G = TypeParam;
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const G X = random_element<G>(random);
    const typename G::Tangent xi = testing::random_tangent<G>(random, 0.3, 0.1);
    EXPECT_EQ(plus(xi, X), G::exp(xi) * X);
    EXPECT_THAT(minus(plus(xi, X), X), MatrixNear(xi, 1e-14));
    EXPECT_THAT(plus(xi, plus(xi, X)), GroupNear(plus((2 * xi).eval(), X), 1e-14));
  }
}

TYPED_TEST(LieLaws, PlusUndoesMinus) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->ys[i]);
    const double tolerance = this->tolerance(this->xs[i], 5e-15) + this->tolerance(this->ys[i], 5e-15);
    EXPECT_THAT(plus(minus(X, Y), Y), GroupNear(X, tolerance));
    EXPECT_THAT(X * between(X, Y), GroupNear(Y, tolerance));
  }
}

TYPED_TEST(LieLaws, InterpolationHitsItsEnds) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->ys[i]);
    const double tolerance = this->tolerance(this->xs[i], 5e-15) + this->tolerance(this->ys[i], 5e-15);
    EXPECT_THAT(interpolate(X, Y, 0.0), GroupNear(X, tolerance));
    EXPECT_THAT(interpolate(X, Y, 1.0), GroupNear(Y, tolerance));
  }
}

TYPED_TEST(LieLaws, InterpolationDoesNotDependOnTheFrame) {
  using G = TypeParam;
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const G X = random_element<G>(random), Y = plus(testing::random_tangent<G>(random, 2.0, 1.0), X);
    const G A = random_element<G>(random);
    const double s = random.uniform(-0.5, 1.5);
    EXPECT_THAT(interpolate(A * X, A * Y, s), GroupNear(A * interpolate(X, Y, s), 1e-13));
    EXPECT_THAT(interpolate(X * A, Y * A, s), GroupNear(interpolate(X, Y, s) * A, 1e-13));
    EXPECT_THAT(interpolate(Y, X, 1 - s), GroupNear(interpolate(X, Y, s), 1e-13));
    const G middle = interpolate(X, Y, 0.5);  // half way in equal steps
    EXPECT_THAT(minus(middle, X), MatrixNear(minus(Y, middle), 1e-13));
  }
}

TYPED_TEST(LieLaws, AHundredThousandProductsDoNotDrift) {
  using G = TypeParam;
  Random random(6);
  const G step = random_element<G>(random, 1.0, 1e-3);
  G X;
  for (int i = 0; i < 100000; ++i) X = X * step;
  constexpr int kSize = G::kRotationDof == 1 ? 2 : 3;
  const Eigen::Matrix<double, kSize, kSize> R = X.matrix().template topLeftCorner<kSize, kSize>();
  EXPECT_THAT((R.transpose() * R).eval(),
              MatrixNear(Eigen::Matrix<double, kSize, kSize>::Identity().eval(), 1e-15));
}

TYPED_TEST(LieLaws, SameInputSameBits) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const auto run = [&] { return (G::exp(this->xs[i]) * G::exp(this->ys[i]).inverse()); };
    EXPECT_EQ(run(), run());
    EXPECT_EQ(run().log(), run().log());
  }
}

}  // namespace
}  // namespace waymark
