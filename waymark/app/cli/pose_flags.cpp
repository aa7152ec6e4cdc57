#include "waymark/app/cli/pose_flags.hpp"

#include "waymark/app/cli/job_flags.hpp"
#include "waymark/app/cli/options_flags.hpp"

namespace waymark::cli {

PoseFlags::PoseFlags(CLI::App& verb) : app_(verb) { add_fields(verb, words_); }

Status PoseFlags::refuse_all(const std::string& why, const std::string& hint) const {
  Refusals refused(app_);
  refused.flags(true, {"--camera", "--camera-name", "--camera-size", "--tag-size-m"}, why, hint);
  return refused.status();
}

}  // namespace waymark::cli
