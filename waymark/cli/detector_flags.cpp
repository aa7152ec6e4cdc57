#include "waymark/cli/detector_flags.hpp"

#include <cstddef>
#include <string>
#include <utility>

#include "waymark/cli/sources.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark::cli {
namespace {

constexpr std::size_t kLargestConfig = std::size_t{1} << 20U;

}  // namespace

DetectorFlags::DetectorFlags(CLI::App& app) : options_(app, "Detector") {
  std::string known;
  for (const FamilyId id : kAllFamilies) known += (known.empty() ? "" : ", ") + std::string(to_string(id));
  app.add_option("--family", families_,
                 "Tag family to look for, tag36h11 unless given; may be given several times. Known: " + known)
      ->type_name("NAME")
      ->allow_extra_args(false)
      ->group("Detector");
  app.add_option("--config", config_path_,
                 "YAML file with these settings, below the key 'detector', dashes written as underscores; "
                 "flags override it")
      ->type_name("FILE")
      ->group("Detector");
}

Result<std::unique_ptr<Detector>> DetectorFlags::make() const {
  DetectConfig config;
  if (!config_path_.empty()) {
    const auto text = read_text(config_path_, kLargestConfig);
    const auto read = text ? parse_fields<DetectConfig>(*text, config_path_) : tl::unexpected(text.error());
    if (!read) return tl::unexpected(read.error());
    config = *read;
  }
  DetectorOptions& options = config.detector;
  if (const Status applied = options_.apply(options); !applied) return tl::unexpected(applied.error());
  for (const std::string& name : families_) {
    auto id = parse_family(name);
    if (id) continue;
    id.error().place.key = "--family";
    return tl::unexpected(std::move(id.error()));
  }
  if (!families_.empty()) options.families = families_;
  return make_apriltag_detector(options);
}

}  // namespace waymark::cli
