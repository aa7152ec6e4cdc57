#pragma once
// Provides the layouts and codes of the families. A build without libapriltag (web/) has a different
// implementation of load_family(). Not intended for use by other programs, because it uses a type from
// AprilTag 3.

#include <memory>

#include "waymark/families/family.hpp"

struct apriltag_family;  // from <apriltag/apriltag.h>

namespace waymark {

using AprilTagFamily = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

/// AprilTag 3's table for a family; each call creates a new one.
[[nodiscard]] AprilTagFamily make_apriltag_family(FamilyId id);

/// Layout and codes of a family; each call reads them again.
[[nodiscard]] Family load_family(FamilyId id);

}  // namespace waymark
