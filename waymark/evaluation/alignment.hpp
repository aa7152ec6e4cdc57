#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/evaluation/pose_pairs.hpp"

namespace waymark {

/// What may be moved before errors are measured. An answer in the map's own frame needs None; a trajectory in
/// a frame of its own (odometry) can be judged by its shape only.
enum class AlignmentKind : std::uint8_t { None, Se2, Se3, Sim3 };

/// "none", "se2", "se3", "sim3".
[[nodiscard]] std::string_view to_string(AlignmentKind kind);
[[nodiscard]] std::optional<AlignmentKind> alignment_kind(std::string_view word);

/// ref_p = scale * ref_R_est * est_p + ref_t.
struct Alignment {
  double scale = 1;
  SE3 ref_T_est{};

  [[nodiscard]] SE3 operator()(const SE3& est_T_base) const {
    return {ref_T_est.rotation() * est_T_base.rotation(),
            scale * (ref_T_est.rotation() * est_T_base.translation()) + ref_T_est.translation()};
  }
};

/// The alignment with the least sum of squared distances of positions (Umeyama, "Least-Squares Estimation of
/// Transformation Parameters Between Two Point Patterns", 1991, equations 40-42), as evo's --align and
/// --correct_scale find it; se2 turns about z and shifts in x and y only. Fails (InvalidArgument) on fewer
/// than three pairs or positions that do not spread enough to tell a rotation. O(pairs).
[[nodiscard]] Result<Alignment> align(const std::vector<PosePair>& pairs, AlignmentKind kind);

}  // namespace waymark
