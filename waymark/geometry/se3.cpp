#include "waymark/geometry/se3.hpp"

namespace waymark {

Result<SE3> SE3::try_from_matrix(const Matrix& a_T_b, double tolerance) {
  if (!a_T_b.allFinite()) {
    return fail(ErrorCode::InvalidArgument, "a transform with an entry that is not a finite number", {},
                "Give sixteen finite numbers.");
  }
  if (!((a_T_b.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() <= tolerance)) {
    return fail(ErrorCode::InvalidArgument, "a transform whose last row is not 0 0 0 1", {},
                "Give the matrix row by row, with the translation in the last column.");
  }
  return SO3::try_from_matrix(a_T_b.topLeftCorner<3, 3>(), tolerance).map([&](const SO3& a_R_b) {
    return SE3(a_R_b, a_T_b.topRightCorner<3, 1>());
  });
}

}  // namespace waymark
