#pragma once
// Inside the room: where the layouts and codes come from. A build without libapriltag (web/) has another
// source for this one function.

#include "waymark/families/family.hpp"

namespace waymark {

/// Layout and codes of a family, read anew.
[[nodiscard]] Family load_family(FamilyId id);

}  // namespace waymark
