#include "waymark/cli/map_flags.hpp"

#include <algorithm>

#include "waymark/cli/job_flags.hpp"

namespace waymark::cli {
namespace {

/// Options that scenes have no use for.
Status check_tagslam_flags(const MapArgs& args) {
  const std::vector<std::string> known = {
      "LAP",    "output", "tagslam",  "model",        "against",     "json",           "help",
      "config", "set",    "help-all", "outlier-chi2", "robust-chi2", "max-iterations", "free-intrinsics"};
  for (const CLI::Option* option : args.settings.app().get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() > 0 && std::ranges::find(known, name) == known.end())
      return fail(ErrorCode::InvalidArgument, kNotOfScenes, {.key = option->get_name()}, kNoTagslam);
  }
  Refusals refused(args.settings.app());
  args.refuse_lap_options(refused, kNotOfScenes, kNoTagslam);
  refused.all(true, args.detector, kNotOfScenes, kNoTagslam);
  return refused.status();
}

}  // namespace

void MapArgs::refuse_lap_options(Refusals& refused, const char* why, const char* hint) const {
  for (const char* key : {"estimate_noise", "find_mounting", "keep_mounting"})
    refused.options(true, bundle, why, hint, key);
  for (const std::string& key : field_names<LapModelOptions>()) refused.options(true, bundle, why, hint, key);
  refused.options(true, chain, why, hint);
  refused.options(true, points, why, hint);
  refused.options(true, route, why, hint);
}

Status MapArgs::check() const {
  if (Status sound = check_effects(*this, given_on(settings.app())); !sound) return sound;
  if (!scene.tagslam.empty()) return check_tagslam_flags(*this);
  Refusals refused(settings.app());
  refused.options(of.method == "chain", bundle, "the method chain does not optimise",
                  "Leave it out, or --method chain.");
  return refused.status();
}

Result<MapJob> MapArgs::make_job() const {
  MapJob made = job;
  Status status = bundle.apply(made.options.bundle);
  if (status) status = chain.apply(made.options.chain);
  if (status) status = points.apply(made.points);
  if (status) status = route.apply(made.options.route);
  if (status) status = describe_map(of, made);
  if (!status) return tl::unexpected(status.error());
  return made;
}

Result<MapSceneJob> MapArgs::make_scene_job() const {
  BundleMapOptions options;
  const Status status = bundle.apply(options);
  return status ? described_scene(*this, options.search) : tl::unexpected(status.error());
}

MapArgs::MapArgs(CLI::App& verb)
    : settings(verb),
      bundle(settings, "bundle", "Method bundle"),
      chain(settings, "chain", "Where the search starts, and method chain"),
      points(settings, "points", "Recordings with poses of tags and no corners"),
      route(settings, "route", "Route"),
      detector(settings, "Detector") {
  add_fields(verb, static_cast<MapWords&>(*this));
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli
