#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

Verb tags_verb() {
  return {.name = "tags",
          .sentence = "Print tags and calibration boards",
          .help =
              "Example:\n"
              "  waymark tags sheet --family 36h11 --ids 0-23 --tag-size-m 0.16 --paper A4 -o tags.pdf\n",
          .verbs = {tags_sheet_verb(), tags_board_verb()}};
}

}  // namespace waymark::cli
