#include "waymark/recording/ros2/frame_tree.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace waymark {
namespace {

/// Tolerance within which repeated messages with the same transform are equal.
constexpr double kSame_m = 5e-4;
constexpr double kSame_rad = 5e-4;
constexpr std::size_t kMaxLinks = 10'000;
constexpr std::size_t kMaxShown = 60;

bool same(const SE3& a, const SE3& b) {
  const SE3 between = a.inverse() * b;
  return between.translation().norm() < kSame_m && between.rotation().log().norm() < kSame_rad;
}

}  // namespace

std::string frame_name(std::string_view name) {
  while (name.starts_with('/')) name.remove_prefix(1);
  return std::string(name);
}

void FrameTree::add(std::string_view parent_name, std::string_view child_name,
                    const std::optional<SE3>& parent_T_child) {
  const std::string parent = frame_name(parent_name);
  const std::string child = frame_name(child_name);
  if (links_.size() >= kMaxLinks && !links_.contains(child)) return;
  frames_.insert({parent, child});
  const auto [known, is_new] = links_.try_emplace(child, Link{parent, parent_T_child, false, {}});
  if (is_new) return;
  Link& link = known->second;
  if (link.parent != parent) {
    link.other_parents.insert(parent);
  } else if (!parent_T_child || !link.parent_T_child) {
    link.parent_T_child.reset();
  } else if (!same(*link.parent_T_child, *parent_T_child)) {
    link.changes = true;
  }
}

const FrameTree::Link* FrameTree::link_to(const std::string& child) const {
  const auto link = links_.find(child);
  return link == links_.end() ? nullptr : &link->second;
}

std::vector<std::string> FrameTree::path_up(const std::string& frame) const {
  std::vector<std::string> way{frame};
  std::set<std::string> passed{frame};
  for (const Link* link = link_to(frame); link != nullptr; link = link_to(way.back())) {
    way.push_back(link->parent);
    if (!passed.insert(link->parent).second) break;
  }
  return way;
}

bool FrameTree::joined(const std::string& a, const std::string& b) const {
  if (!has(a) || !has(b)) return false;
  const std::vector<std::string> of_a = path_up(a);
  const std::vector<std::string> of_b = path_up(b);
  return std::ranges::find_first_of(of_a, of_b) != of_a.end();
}

bool FrameTree::below(const std::string& parent, const std::string& child) const {
  const std::vector<std::string> way = path_up(child);
  return std::ranges::find(way, parent) != way.end();
}

std::string FrameTree::problems_of(const Link& link) const {
  std::vector<std::string> problems;
  if (!link.other_parents.empty())
    problems.push_back(fmt::format("also has parent {}", fmt::join(link.other_parents, ", ")));
  if (link.changes) problems.emplace_back("moves");
  if (!link.parent_T_child) problems.emplace_back("invalid values");
  return fmt::format("{}", fmt::join(problems, "; "));
}

void FrameTree::write(const std::string& frame, int depth, std::set<std::string>& written,
                      std::string& out) const {
  if (written.size() >= kMaxShown || !written.insert(frame).second) return;
  const Link* link = link_to(frame);
  const std::string problems = link == nullptr ? "" : problems_of(*link);
  out += fmt::format("\n  {:>{}}{}{}", "", 2 * std::min(depth, 20), frame.empty() ? "''" : frame,
                     problems.empty() ? "" : fmt::format("  ({})", problems));
  for (const auto& [child, below] : links_)
    if (below.parent == frame) write(child, depth + 1, written, out);
}

std::string FrameTree::text() const {
  if (empty()) return "there are no transforms (/tf_static, /tf)";
  std::string out = "the transforms are:";
  std::set<std::string> written;
  for (const std::string& frame : frames_)
    if (link_to(frame) == nullptr) write(frame, 0, written, out);
  for (const std::string& frame : frames_) write(frame, 0, written, out);  // frames in a cycle have no root
  if (written.size() < frames_.size())
    out += fmt::format("\n  … and {} more", frames_.size() - written.size());
  return out;
}

tl::unexpected<Error> FrameTree::no_chain(std::string message, std::string hint) const {
  return fail(ErrorCode::NotFound, message + "; " + text(), {}, std::move(hint));
}

/// Fails if the path up from a frame returns to that frame. The transforms in a cycle contradict each other
/// unless they multiply to the identity, and the result depends on where the cycle is entered.
Status FrameTree::check_circle(const std::vector<std::string>& way) const {
  const auto first = std::ranges::find(way, way.back());
  if (first == std::prev(way.end())) return {};
  const std::vector<std::string> circle(way.rbegin(), std::make_reverse_iterator(first));
  return no_chain(fmt::format("the transforms form a cycle: {}", fmt::join(circle, " -> ")),
                  "Fix the publisher of these transforms, or pass the mounting with `robot=FILE`.");
}

Result<SE3> FrameTree::down(const std::string& ancestor, const std::string& frame) const {
  SE3 ancestor_T_frame;
  std::string at = frame;
  while (at != ancestor) {
    const Link* link = link_to(at);
    const std::string problems = problems_of(*link);
    if (!problems.empty())
      return no_chain(
          fmt::format("the transform from '{}' to '{}' cannot be used ({})", link->parent, at, problems),
          link->changes
              ? "The camera must not move on the robot. Choose other frames with `base_frame` and "
                "`camera_frame`, or pass the mounting with `robot=FILE`."
              : "Choose other frames with `base_frame` and `camera_frame`, or pass the mounting with "
                "`robot=FILE`.");
    ancestor_T_frame = *link->parent_T_child * ancestor_T_frame;
    at = link->parent;
  }
  return ancestor_T_frame;
}

Result<SE3> FrameTree::chain(const std::string& from, const std::string& to) const {
  for (const std::string& frame : {from, to}) {
    if (!has(frame))
      return no_chain(fmt::format("no transform contains frame '{}'", frame),
                      "Set the frames of base and camera with `base_frame` and `camera_frame`, or pass "
                      "the mounting with `robot=FILE`.");
  }
  const std::vector<std::string> of_from = path_up(from);
  const std::vector<std::string> of_to = path_up(to);
  const auto meet = std::ranges::find_first_of(of_to, of_from);
  if (meet == of_to.end())
    return no_chain(fmt::format("no chain of transforms connects '{}' to '{}'", from, to),
                    "Record the transforms between them (/tf_static), set other frames with `base_frame` and "
                    "`camera_frame`, or pass the mounting with `robot=FILE`.");
  for (const auto* way : {&of_to, &of_from})
    if (Status status = check_circle(*way); !status) return tl::unexpected(status.error());
  const Result<SE3> meet_T_from = down(*meet, from);
  if (!meet_T_from) return meet_T_from;
  const Result<SE3> meet_T_to = down(*meet, to);
  if (!meet_T_to) return meet_T_to;
  return meet_T_from->inverse() * *meet_T_to;
}

}  // namespace waymark
