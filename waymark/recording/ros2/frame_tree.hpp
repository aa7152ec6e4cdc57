#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// A frame's name without the leading slash that older programs write.
[[nodiscard]] std::string frame_name(std::string_view name);

/// Frames and their transforms, as in /tf_static and /tf. chain() validates every transform it uses.
class FrameTree {
 public:
  /// `parent_T_child` is empty if the values in the message are invalid.
  void add(std::string_view parent, std::string_view child, const std::optional<SE3>& parent_T_child);

  [[nodiscard]] bool empty() const { return links_.empty(); }
  [[nodiscard]] bool has(const std::string& frame) const { return frames_.contains(frame); }
  [[nodiscard]] const std::set<std::string>& frames() const { return frames_; }
  /// Whether transforms connect the two frames, valid or not.
  [[nodiscard]] bool joined(const std::string& a, const std::string& b) const;
  /// Whether `child` is a descendant of `parent`.
  [[nodiscard]] bool below(const std::string& parent, const std::string& child) const;

  /// Composes the transform between two frames of one body. Fails if a frame is missing or the frames are not
  /// connected. Also fails if a transform between them moves, has two parents, is part of a cycle or is
  /// invalid. The error shows the tree.
  [[nodiscard]] Result<SE3> chain(const std::string& from, const std::string& to) const;

  /// The tree as text for display, with one frame per line and children indented, followed by the problems of
  /// each transform.
  [[nodiscard]] std::string text() const;

 private:
  struct Link {
    std::string parent{};
    std::optional<SE3> parent_T_child{};
    bool changes = false;  ///< has been published with different values
    std::set<std::string> other_parents{};
  };

  [[nodiscard]] const Link* link_to(const std::string& child) const;
  /// Frames from `frame` up to the root, or to where a cycle closes.
  [[nodiscard]] std::vector<std::string> path_up(const std::string& frame) const;
  [[nodiscard]] std::string problems_of(const Link& link) const;
  void write(const std::string& frame, int depth, std::set<std::string>& written, std::string& out) const;
  [[nodiscard]] tl::unexpected<Error> no_chain(std::string message, std::string hint) const;
  [[nodiscard]] Status check_circle(const std::vector<std::string>& way) const;
  /// The transform from `ancestor` to its descendant `frame`; the path must not contain a cycle.
  [[nodiscard]] Result<SE3> down(const std::string& ancestor, const std::string& frame) const;

  std::map<std::string, Link> links_;  ///< by child frame
  std::set<std::string> frames_;
};

}  // namespace waymark
