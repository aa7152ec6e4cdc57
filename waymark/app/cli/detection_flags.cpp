#include "waymark/app/cli/detection_flags.hpp"

#include <string>
#include <utility>

#include "waymark/app/cli/flags.hpp"
#include "waymark/app/common/detect_all.hpp"

namespace waymark::cli {
namespace {

constexpr const char* kSet = "Omit this flag, or omit --no-refine.";

}  // namespace

DetectorFlags::DetectorFlags(Settings& settings, const char* group)
    : app_(settings.app()),
      detector_(settings, "detector", "Detector"),
      refinement_(settings, "refinement", "Corner refinement") {
  std::string families;
  for (const FamilyId id : kAllFamilies)
    families += (families.empty() ? "" : ", ") + std::string(to_string(id));
  CLI::App& app = settings.app();
  add_option(app, "--family NAME", families_,
             "Tag family to detect (repeatable); default tag36h11. One of " + families, in_group(group))
      ->allow_extra_args(false);
  add_flag(app, "--no-refine", no_refine_, "Keep the corners of the detector, which have no covariance",
           in_group(group));
}

bool DetectorFlags::given() const {
  return detector_.given() || refinement_.given() || !families_.empty() || no_refine_;
}

Status DetectorFlags::refuse_all(const std::string& why, const std::string& hint) const {
  Refusals refused(app_);
  refused.options(true, detector_, why, hint);
  refused.options(true, refinement_, why, hint);
  refused.fields(true, {"family", "no_refine"}, why, hint);
  return refused.status();
}

Result<std::vector<FamilyId>> DetectorFlags::families() const {
  DetectorOptions options;
  if (Status applied = detector_.apply(options); !applied) return tl::unexpected(applied.error());
  if (!families_.empty()) options.families = families_;
  auto ids = chosen_families(options);
  if (!ids && !families_.empty()) ids.error().place.key = "family";
  return ids;
}

Result<TagFinder> DetectorFlags::make() const {
  DetectorOptions options;
  RefinementOptions refinement;
  Status applied = detector_.apply(options);
  if (applied) applied = refinement_.apply(refinement);
  if (applied && no_refine_) applied = refuse(refinement_, "corners are not refined", kSet);
  if (!applied) return tl::unexpected(applied.error());
  return described_finder(std::move(options), refinement, families_, !no_refine_);
}

PoseFlags::PoseFlags(CLI::App& verb) : app_(verb) { add_fields(verb, words_); }

Status PoseFlags::refuse_all(const std::string& why, const std::string& hint) const {
  Refusals refused(app_);
  refused.fields(true, {"camera", "camera_name", "camera_size", "tag_size_m"}, why, hint);
  return refused.status();
}

}  // namespace waymark::cli
