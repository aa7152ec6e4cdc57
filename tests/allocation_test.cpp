// Nothing here touches the heap: safe in a filter at any rate. This test program is compiled with
// EIGEN_RUNTIME_NO_MALLOC.
#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertain_draw.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

class NoAllocation {
 public:
  NoAllocation() { Eigen::internal::set_is_malloc_allowed(false); }
  ~NoAllocation() { Eigen::internal::set_is_malloc_allowed(true); }
  NoAllocation(const NoAllocation&) = delete;
  NoAllocation& operator=(const NoAllocation&) = delete;
};

template <class G>
class Allocation : public ::testing::Test {};
using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(Allocation, Groups);

TYPED_TEST(Allocation, NoOperationAllocates) {
  using G = TypeParam;
  Random random(61);
  const typename G::Tangent xi = 0.1 * G::Tangent::Ones();
  typename G::Jacobian J_X, J_Y;
  bool finite = true;
  {
    const NoAllocation guard;
    const G X = G::exp(xi), Y = interpolate(X, X * X, 0.3, &J_X, &J_Y);
    finite = finite && minus(X, between(X, Y, &J_X, &J_Y)).allFinite();
    finite = finite && (G::left_jacobian(xi) * G::right_jacobian_inverse(xi)).allFinite();
    const Uncertain<G> x{X, G::Jacobian::Identity()};
    finite = finite && coordinate_covariance(between(x, compose(x, inverse(x)))).allFinite();
    finite = finite && sample(x, random).matrix().allFinite();
  }
  EXPECT_TRUE(finite);
}

TEST(AllocationOfPoses, NeitherDoTheNearestRotationNorTheViewFromAbove) {
  const NoAllocation guard;
  const SO3 X = SO3::from_matrix(Eigen::Matrix3d::Identity() + 0.1 * Eigen::Matrix3d::Ones());
  EXPECT_TRUE(lift(project_to_plane(SE3(X, {1, 2, 3}))).matrix().allFinite());
}

#ifndef NDEBUG
TEST(AllocationDeathTest, TheGuardWouldNotice) {
  ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  EXPECT_DEATH(
      {
        const NoAllocation guard;
        const Eigen::VectorXd on_the_heap = Eigen::VectorXd::Zero(10);
        EXPECT_EQ(on_the_heap[0], 0);
      },
      "heap allocation is forbidden");
}
#endif

}  // namespace
}  // namespace waymark
