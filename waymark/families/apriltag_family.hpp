#pragma once
// Source of the layouts and codes of the families. A build without libapriltag (web/) has another
// implementation of load_family(). Not for other programs, because it uses a type of AprilTag 3.

#include <memory>

#include "waymark/families/family.hpp"

struct apriltag_family;  // of <apriltag/apriltag.h>

namespace waymark {

using AprilTagFamily = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

/// AprilTag 3's table of a family; each call creates a new one.
[[nodiscard]] AprilTagFamily make_apriltag_family(FamilyId id);

/// Layout and codes of a family; each call reads them again.
[[nodiscard]] Family load_family(FamilyId id);

}  // namespace waymark
