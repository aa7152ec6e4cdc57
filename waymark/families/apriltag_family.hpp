#pragma once
// Where the layouts and codes of the families come from. A build without libapriltag (web/) has another
// source for load_family(). Not for other programs: AprilTag 3's own type.

#include <memory>

#include "waymark/families/family.hpp"

struct apriltag_family;  // of <apriltag/apriltag.h>

namespace waymark {

using AprilTagFamily = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

/// AprilTag 3's table of a family, made anew.
[[nodiscard]] AprilTagFamily make_apriltag_family(FamilyId id);

/// Layout and codes of a family, read anew.
[[nodiscard]] Family load_family(FamilyId id);

}  // namespace waymark
