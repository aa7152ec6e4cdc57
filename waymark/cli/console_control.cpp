#include "waymark/cli/console_control.hpp"

#include "waymark/cli/interrupt.hpp"

namespace waymark::cli {

JobControl silent_control() {
  JobControl control;
  control.cancelled = interrupted;
  return control;
}

JobControl control_from(Console& console) {
  JobControl control = silent_control();
  control.progress = [&console](const JobProgress& now) {
    if (now.all > 0)
      console.progress(now.done, now.all, now.words);
    else
      console.live(now.words);
  };
  control.note = [&console](const std::string& words) { console.say(words); };
  return control;
}

}  // namespace waymark::cli
