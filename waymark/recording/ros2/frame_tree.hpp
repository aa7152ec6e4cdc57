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

/// A frame's name without the slash that older programs put before it.
[[nodiscard]] std::string frame_name(std::string_view name);

/// Frames and how they hang together, as /tf_static and /tf say. Nothing is accepted silently: chain() checks
/// every link it goes over.
class FrameTree {
 public:
  /// `parent_T_child` is nothing when the numbers of the message are none.
  void add(std::string_view parent, std::string_view child, const std::optional<SE3>& parent_T_child);

  [[nodiscard]] bool empty() const { return links_.empty(); }
  [[nodiscard]] bool has(const std::string& frame) const { return frames_.contains(frame); }
  [[nodiscard]] const std::set<std::string>& frames() const { return frames_; }
  /// Whether a way leads from one frame to the other, sound or not.
  [[nodiscard]] bool joined(const std::string& a, const std::string& b) const;
  /// Whether the child hangs below the parent, however deep.
  [[nodiscard]] bool below(const std::string& parent, const std::string& child) const;

  /// The composed transform from one frame to another of the same body. Fails, and shows the tree, where a
  /// frame is not there, no way leads from one to the other, or a link on the way moves, has two parents, is
  /// in a circle or has numbers that are none.
  [[nodiscard]] Result<SE3> chain(const std::string& from, const std::string& to) const;

  /// The tree for people, a frame a line, children indented; what is doubtful about a link behind it.
  [[nodiscard]] std::string text() const;

 private:
  struct Link {
    std::string parent{};
    std::optional<SE3> parent_T_child{};
    bool changes = false;  ///< said more than once, and differently
    std::set<std::string> other_parents{};
  };

  [[nodiscard]] const Link* link_to(const std::string& child) const;
  /// From a frame up to the root, or to where a circle closes.
  [[nodiscard]] std::vector<std::string> way_up(const std::string& frame) const;
  [[nodiscard]] std::string doubts_of(const Link& link) const;
  void write(const std::string& frame, int depth, std::set<std::string>& written, std::string& out) const;
  [[nodiscard]] tl::unexpected<Error> no_chain(std::string message, std::string hint) const;
  [[nodiscard]] Status check_circle(const std::vector<std::string>& way) const;
  /// The frame seen from the one of its forebears; the way up from it has no circle.
  [[nodiscard]] Result<SE3> down(const std::string& ancestor, const std::string& frame) const;

  std::map<std::string, Link> links_;  ///< by child
  std::set<std::string> frames_;
};

}  // namespace waymark
