#include "waymark/app/common/duplicate_tag_fields.hpp"

namespace waymark {

ReportFields fields(const DuplicateTag& duplicate) {
  return {{"tag", "Tag", to_string(duplicate.tag)},
          {"position_m", "Centre of the tag in the map: x, y, z; on a moving body, in its frame",
           duplicate.here_m},
          {"other_position_m", "Centre of the other tag", duplicate.there_m},
          {"distance_m", "Distance between the two places", duplicate.distance_m},
          {"observations", "Number of observations of the tag in the map", duplicate.here},
          {"other_observations", "Number of observations of the other tag", duplicate.there},
          {"at_once", "Whether both were observed at the same time; otherwise, one tag may have been moved",
           duplicate.at_once},
          {"one_after_the_other", "Whether most observations of one are earlier than those of the other",
           duplicate.one_after_the_other}};
}

}  // namespace waymark
