#include "waymark/cli/tag_size_flags.hpp"

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

namespace waymark::cli {

TagSizeFlags::TagSizeFlags(CLI::App& app) {
  app.add_option(
         "--tag-at-m", trial.distance_m,
         "Measure the printed size of a tag that hangs at this distance, from the front of the lens to "
         "its centre, measured with a tape to a centimetre")
      ->check(CLI::Range(0.2, 20.0))
      ->needs("--camera-source")
      ->type_name("FLOAT");
  app.add_option("--tag-size-m", trial.size_m, "Side that the black square of that tag should have")
      ->check(CLI::Range(0.001, 10.0))
      ->needs("--tag-at-m")
      ->type_name("FLOAT");
  app.get_option("--tag-at-m")->needs("--tag-size-m");
}

std::vector<DoctorLine> TagSizeFlags::check(const std::vector<std::string>& sources,
                                            const std::string& calibration) const {
  std::vector<DoctorLine> lines;
  if (trial.distance_m <= 0) return lines;
  for (const std::string& source : sources) lines.push_back(check_tag_size(source, calibration, trial));
  return lines;
}

}  // namespace waymark::cli
