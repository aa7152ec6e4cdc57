#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "waymark/mapping/scene/place_poses.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark::internal {

/// The steps of the search for the poses of a scene: initial values, minimisation, noise, and which
/// observations to use. map_scene() combines them.
class SceneSearch {
 public:
  static constexpr double kStartPx = 0.5;      // noise of corners before it is estimated
  static constexpr double kCoarseGain = 1e-3;  // accuracy sufficient to find outliers
  static constexpr double kRoughGain = 1e-4;   // accuracy sufficient to select observations
  static constexpr double kFineGain = 1e-8;

  SceneSearch(const SceneRecording& recording, const SceneMapOptions& options, const MapProgress& progress,
              SceneMap& map)
      : recording_(recording), options_(options), progress_(progress), map_(map) {}

  [[nodiscard]] const SceneRecording& recording() const { return recording_; }
  [[nodiscard]] const SceneMapOptions& options() const { return options_; }
  [[nodiscard]] SceneMap& map() const { return map_; }
  [[nodiscard]] Bundle& bundle() const { return map_.problem.bundle; }
  [[nodiscard]] double noise_px() const { return noise_px_; }
  [[nodiscard]] bool goes_on() const { return map_.summary.usable(); }

  /// A state of the search that can be returned to.
  struct State {
    Bundle bundle{};
    std::vector<char> placed{};
    std::vector<KnownPose> known{};
    BundleSummary summary{};
    double noise_px = 0;
  };
  [[nodiscard]] State state() const;
  void go_to(State state);

  /// Computes initial values of all poses from those that are known. `change`: of what is known, before.
  void place(const std::function<void(std::vector<KnownPose>&)>& change = {});
  /// Places all poses, minimises the robust cost, and moves poses that are in a wrong local minimum.
  void search_from_placed();
  /// Moves poses that contradict their observations to better initial values. Returns how many.
  int replace_contradicted(double chi2);
  /// Minimises the cost. `robust_chi2`: of the robust loss; 0: none.
  void find(double robust_chi2, int steps, const char* stage, double relative_gain = kFineGain);
  /// Repeats until the set of observations in use and the noise estimate no longer change.
  void adjust_until_stable();

  /// Which observations of an id confirm each other. Here, a view contains the observations of one camera at
  /// one time. It does not depend on how the observations are divided into places, because each place
  /// consists of groups. Thus, it is computed once, or again if other mountings of cameras are known.
  const Confirmation& confirmation();
  /// From now on, these observations do not count as confirmed.
  void leave_unconfirmed(const std::vector<std::size_t>& terms) {
    unconfirmed_.insert(unconfirmed_.end(), terms.begin(), terms.end());
  }
  /// Frees what only initial values need.
  void forget_squares() {
    squares_ = {};
    confirmation_ = {};
  }
  void forget_factor() { factor_.forget(); }

  /// Sets the same noise for all corners.
  void set_corner_noise(double sigma_px);
  /// Downweights images with persistent errors.
  void count_correlated();
  /// The chi2 of each corner term, without the downweighting of correlated images.
  [[nodiscard]] std::vector<double> chi2_of_corners() const;
  /// Rejects observations that do not fit. Returns whether the set of those in use has changed.
  bool gate_observations();

  /// Whether odometry may be rejected.
  [[nodiscard]] bool judges_odometry() const;
  /// While odometry is trusted, none is rejected.
  void trust_odometry(bool trusts) { trusts_odometry_ = trusts; }

 private:
  void place_all();
  [[nodiscard]] Confirmation confirm();
  const std::vector<std::vector<Hypothesis>>& squares();
  [[nodiscard]] std::vector<ViewMotion> motions_of_views(std::size_t frames, std::size_t cameras) const;
  [[nodiscard]] double unknowns_of_poses() const;
  [[nodiscard]] double noise_ratio() const;

  const SceneRecording& recording_;
  const SceneMapOptions& options_;
  const MapProgress& progress_;
  SceneMap& map_;
  std::vector<KnownPose> known_{};
  KeptFactor factor_{};
  double noise_px_ = kStartPx;
  std::vector<std::vector<Hypothesis>> squares_{};  ///< of each corner term; see squares()
  std::optional<Confirmation> confirmation_{};
  std::vector<std::size_t> unconfirmed_{};  ///< in addition to those of the confirmation
  std::vector<char> known_cameras_{};       ///< with which it was computed
  bool trusts_odometry_ = false;
};

}  // namespace waymark::internal
