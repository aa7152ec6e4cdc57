#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/pose/consensus.hpp"

namespace waymark::internal {

/// Grows a consensus from one pose of one tag. Keeps its memory between searches.
class Growth {
 public:
  Growth(const CameraModel& camera, std::vector<Candidate>& candidates, const MultiTagOptions& options)
      : camera_(camera),
        candidates_(candidates),
        options_(options),
        fits_(candidates.size()),
        tags_(candidates.size()) {
    for (const Candidate& c : candidates)
      map_is_uncertain_ = map_is_uncertain_ || c.mapped->covariance.has_value();
  }

  /// The consensus that grows from one pose of one tag; nothing when not even that tag fits. Tags may send
  /// each other away, the seed too.
  std::optional<Consensus> from(std::size_t seed, const SE3& start) { return search(seed, start, true); }
  /// The same of the seed alone.
  std::optional<Consensus> alone(std::size_t seed, const SE3& start) { return search(seed, start, false); }

 private:
  struct Tag {
    bool is_member = false;
    int expulsions = 0;
    bool tried = false;      ///< together with the present members, in vain
    double unexplained = 1;  ///< part of its chi2 that one Gauss-Newton step together with the members leaves
  };
  struct Solved {
    NormalEquations sum;
    Vector6 xi;
  };

  [[nodiscard]] Eigen::Vector3d pivot_of(const SE3& cam_T_map) const { return cam_T_map * map_pivot_; }
  [[nodiscard]] bool may_join(std::size_t i) const;
  void set_member(std::size_t i, bool is_member);
  void evaluate(const Candidate& candidate, const SE3& cam_T_map, TagFit& fit) const;
  [[nodiscard]] bool evaluate_members(const SE3& cam_T_map);
  void evaluate_others(const SE3& cam_T_map);
  [[nodiscard]] std::optional<SE3> refine_alone(std::size_t seed, const SE3& start) const;
  [[nodiscard]] std::optional<Solved> solve() const;
  bool settle(SE3& cam_T_map, bool others_may_join);
  bool let_join(const Solved& members);
  bool try_to_join(SE3& cam_T_map);
  bool try_one(std::size_t i, SE3& cam_T_map);
  [[nodiscard]] double excess(std::size_t i) const;
  bool expel_worst();
  bool linearise_map_again(const SE3& cam_T_map);
  void linearise_map(const SE3& cam_T_map);
  [[nodiscard]] std::optional<Consensus> finish(const SE3& cam_T_map) const;
  std::optional<Consensus> search(std::size_t seed, const SE3& start, bool others_may_join);

  const CameraModel& camera_;
  std::vector<Candidate>& candidates_;
  const MultiTagOptions& options_;
  std::vector<TagFit> fits_;
  std::vector<Tag> tags_;
  Eigen::Vector3d map_pivot_ = Eigen::Vector3d::Zero();
  bool map_is_uncertain_ = false;
  SE3 linearised_at_{};
  int linearisations_ = 0;
};

}  // namespace waymark::internal
