#include "waymark/app/common/thin_cut_fields.hpp"

#include <string>

namespace waymark {
namespace {

constexpr const char* kBeyond = "Tags that only these observations connect";
constexpr const char* kBy = "Tags whose observations connect them";

/// The fields of a cut, with its tags as `name` makes them.
template <class Name>
ReportFields cut_fields(const TagCut& cut, const char* beyond, const char* by, const Name& name) {
  const auto named = [&](const std::vector<TagId>& tags) {
    std::vector<decltype(name(TagId()))> names;
    names.reserve(tags.size());
    for (const TagId& tag : tags) names.push_back(name(tag));
    return names;
  };
  return {{beyond, kBeyond, named(cut.beyond)},
          {by, kBy, named(cut.by)},
          {"observations", "Number of observations", cut.observations},
          {"otherwise_sigma_m",
           "Standard deviation of their positions without these observations; null if nothing else connects "
           "them",
           cut.otherwise_sigma_m}};
}

}  // namespace

ReportFields fields(const TagCut& cut) {
  return cut_fields(cut, "ids", "by_ids", [](const TagId& tag) { return tag.number; });
}

ReportFields fields(const NamedTagCut& named) {
  return cut_fields(named.cut, "tags", "by_tags", [](const TagId& tag) { return to_string(tag); });
}

std::vector<NamedTagCut> named_cuts(const std::vector<TagCut>& cuts) {
  std::vector<NamedTagCut> named;
  named.reserve(cuts.size());
  for (const TagCut& cut : cuts) named.push_back({cut});
  return named;
}

}  // namespace waymark
