#include "waymark/robots/dds/ros_graph.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

struct Distro {
  std::string_view name;
  std::size_t gid_bytes;
};
constexpr std::array<Distro, 10> kDistros = {{{"dashing", 24},
                                              {"eloquent", 24},
                                              {"foxy", 24},
                                              {"galactic", 24},
                                              {"humble", 24},
                                              {"iron", 16},
                                              {"jazzy", 16},
                                              {"kilted", 16},
                                              {"lyrical", 16},
                                              {"rolling", 16}}};

/// Plain little-endian CDR.
class Writer {
 public:
  void number(std::size_t value) {
    while ((bytes_.size() - kEncapsulation) % 4 != 0) bytes_.push_back(0);
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes_.push_back(static_cast<std::uint8_t>((value >> shift) & 0xffU));
  }
  void text(std::string_view words) {
    number(words.size() + 1);
    bytes_.insert(bytes_.end(), words.begin(), words.end());
    bytes_.push_back(0);
  }
  /// The bytes that the Gid has beyond those of the GUID are zero.
  void gid(const Guid& guid, std::size_t size) {
    bytes_.insert(bytes_.end(), guid.begin(), guid.end());
    bytes_.insert(bytes_.end(), size - guid.size(), 0);
  }
  void gids(const std::vector<Guid>& all, std::size_t size) {
    number(all.size());
    for (const Guid& one : all) gid(one, size);
  }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  static constexpr std::size_t kEncapsulation = 4;
  std::vector<std::uint8_t> bytes_ = {0, 1, 0, 0};
};

}  // namespace

std::vector<std::string> ros_distros() {
  std::vector<std::string> names;
  names.reserve(kDistros.size());
  for (const Distro& one : kDistros) names.emplace_back(one.name);
  return names;
}

Result<SelfDescription> ros_node_description(const std::string& distro, const std::string& node) {
  const auto* known = std::ranges::find(kDistros, distro, &Distro::name);
  if (known == kDistros.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no release '{}' of ROS 2", distro),
                {.key = "ros-distro"}, suggestion(distro, ros_distros()));
  const auto bytes = [node, size = known->gid_bytes](const OwnEndpoints& own) {
    Writer out;
    out.gid(own.participant, size);
    out.number(1);  // node
    out.text("/");
    out.text(node);
    out.gids(own.subscriptions, size);
    out.gids(own.publishers, size);
    return out.take();
  };
  return SelfDescription{{"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"},
                         bytes};
}

Status show_in_node_list(BusOptions& options, const std::string& distro) {
  if (distro.empty()) return {};
  auto self = ros_node_description(distro, options.node);
  if (!self) return tl::unexpected(self.error());
  options.self = std::move(*self);
  return {};
}

}  // namespace waymark
