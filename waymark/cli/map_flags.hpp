#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/cli/detector_flags.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/jobs/map_recording.hpp"
#include "waymark/jobs/map_scene.hpp"

namespace waymark::cli {

/// The flags of `waymark map`. Must stay where it is while the command line is parsed.
struct MapArgs {
  explicit MapArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        bundle(verb, settings, "bundle", "Method bundle"),
        chain(verb, settings, "chain", "Where the search starts, and method chain"),
        points(verb, settings, "points", "Recordings with poses of tags and no corners"),
        route(verb, settings, "route", "Route"),
        detector(verb, settings, "Detector") {}

  const CLI::App& app;
  Settings settings;
  std::string lap;
  std::vector<std::string> more;
  std::string robot;
  CameraChoice frames;
  std::string folder;
  std::string method = "bundle";
  std::string anchor;
  std::vector<std::string> tag_sizes;
  std::string world;
  std::string prior;
  std::string extend;
  std::string route_name;
  std::vector<std::string> freeze;
  std::vector<std::string> remove;
  double map_sigma_m = kMapSigma_m;
  std::string tagslam;
  std::string model = "waymark";
  bool free_intrinsics = false;
  std::string against;
  bool json = false;
  std::vector<double> anchor_pose;
  OptionFlags<BundleMapOptions> bundle;
  OptionFlags<ChainOptions> chain;
  OptionFlags<LandmarkMapOptions> points;
  OptionFlags<RouteOptions> route;
  DetectorFlags detector;

  void add_to(CLI::App& verb);
  /// What is missing (a verb with verbs of its own cannot leave that to the parser), and flags that would be
  /// passed over in silence.
  [[nodiscard]] Status check() const;
  /// Without the maps that are named.
  [[nodiscard]] Result<MapJob> make_job() const;
  /// The maps that are named, and what is said of their tags.
  [[nodiscard]] Status read_maps(MapJob& job) const;
  /// Fails on options of laps of a robot, where the map is made of something else.
  [[nodiscard]] Status refuse_lap_options(const char* why, const char* hint) const;
  /// With --tagslam.
  [[nodiscard]] Result<MapSceneJob> make_scene_job() const;
};

}  // namespace waymark::cli
