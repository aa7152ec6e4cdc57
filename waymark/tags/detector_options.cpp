#include "waymark/tags/detector_options.hpp"

#include <algorithm>

namespace waymark {

Result<std::vector<FamilyId>> chosen_families(const DetectorOptions& options) {
  std::vector<FamilyId> ids;
  for (const std::string& name : options.families) {
    const Result<FamilyId> id = parse_family(name);
    if (!id) return fail(id.error().code, id.error().message, {.key = "families"}, id.error().hint);
    // A family listed twice would report each tag twice.
    if (std::find(ids.begin(), ids.end(), *id) == ids.end()) ids.push_back(*id);
  }
  if (ids.empty()) {
    return fail(ErrorCode::InvalidArgument, "no tag family given", {.key = "families"},
                "Name at least one, e.g. tag36h11.");
  }
  return ids;
}

}  // namespace waymark
