#include "waymark/cli/detector_flags.hpp"

#include <cstddef>
#include <string>
#include <utility>

#include "waymark/config/yaml_fields.hpp"
#include "waymark/jobs/picture_files.hpp"

namespace waymark::cli {
namespace {

constexpr const char* kDetector = "Detector";
constexpr const char* kRefinement = "Corner refinement";
constexpr std::size_t kLargestConfig = std::size_t{1} << 20U;

}  // namespace

DetectorFlags::DetectorFlags(CLI::App& app) : detector_(app, kDetector), refinement_(app, kRefinement) {
  std::string known;
  for (const FamilyId id : kAllFamilies) known += (known.empty() ? "" : ", ") + std::string(to_string(id));
  app.add_option("--family", families_,
                 "Tag family to look for, tag36h11 unless given; may be given several times. Known: " + known)
      ->type_name("NAME")
      ->allow_extra_args(false)
      ->group(kDetector);
  app.add_option("--config", config_path_,
                 "YAML file with these settings, below the keys 'detector' and 'refinement', dashes written "
                 "as underscores; "
                 "flags override it")
      ->type_name("FILE")
      ->group(kDetector);
  app.add_flag("--no-refine", no_refine_,
               "Keep the corners as the detector found them; they have no covariance then")
      ->group(kRefinement);
}

bool DetectorFlags::given() const {
  return detector_.given() || refinement_.given() || !families_.empty() || !config_path_.empty() ||
         no_refine_;
}

Result<TagFinder> DetectorFlags::make() const {
  DetectConfig config;
  if (!config_path_.empty()) {
    const auto text = read_text(config_path_, kLargestConfig);
    const auto read = text ? parse_fields<DetectConfig>(*text, config_path_) : tl::unexpected(text.error());
    if (!read) return tl::unexpected(read.error());
    config = *read;
  }
  Status applied = detector_.apply(config.detector);
  if (applied) applied = refinement_.apply(config.refinement);
  if (!applied) return tl::unexpected(applied.error());
  for (const std::string& name : families_) {
    auto id = parse_family(name);
    if (id) continue;
    id.error().place.key = "--family";
    return tl::unexpected(std::move(id.error()));
  }
  if (!families_.empty()) config.detector.families = families_;
  auto finder = make_tag_finder(config.detector, config.refinement);
  if (finder && no_refine_) finder->refinement.reset();
  return finder;
}

}  // namespace waymark::cli
