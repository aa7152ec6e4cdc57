#pragma once
// Not for other programs: AprilTag 3's own type.

#include <memory>

#include <apriltag/apriltag.h>

#include "waymark/families/family.hpp"

namespace waymark {

using AprilTagFamily = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

/// AprilTag 3's table of a family, made anew.
[[nodiscard]] AprilTagFamily make_apriltag_family(FamilyId id);

}  // namespace waymark
