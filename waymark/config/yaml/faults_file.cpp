#include "waymark/config/yaml/faults_file.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kFaultLimits{.bytes = std::size_t{1} << 20U, .nodes = 50'000, .depth = 8};

Result<FaultKind> kind_of(const YamlCursor& entry) {
  const Result<std::string> name = entry.read_at("fault", &YamlCursor::text);
  if (!name) return tl::unexpected(name.error());
  std::vector<std::string> known;
  for (const auto& [kind, word] : fault_names()) {
    if (word == *name) return kind;
    known.emplace_back(word);
  }
  return entry.at("fault")->fail_here(ErrorCode::InvalidArgument, fmt::format("unknown fault '{}'", *name),
                                      suggestion(*name, known));
}

/// The keys of a fault kind in addition to fault, at_s and for_s.
std::vector<std::string> keys_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::TagMoved:
      return {"id", "x_m", "y_m", "z_m", "turn_deg"};
    case FaultKind::TagRemoved:
      return {"id"};
    case FaultKind::TagDuplicated:
      return {"id", "x_m", "y_m", "z_m", "facing_deg"};
    case FaultKind::TagsSwapped:
      return {"id", "with_id"};
    case FaultKind::Kidnapped:
      return {"forward_m", "left_m", "turn_deg"};
    case FaultKind::Carried:
      return {"forward_m_s", "left_m_s", "turn_deg_s"};
    case FaultKind::BatterySag:
      return {"speed_share"};
    case FaultKind::ClockJump:
      return {"jump_s"};
    case FaultKind::SlipBurst:
      return {"speed_share", "yaw_share"};
    default:
      return {};
  }
}

bool at_one_moment(FaultKind kind) { return kind == FaultKind::Kidnapped || kind == FaultKind::ClockJump; }

Status read_swapped_tag(const YamlCursor& entry, std::string_view key, FamilyId family, TagId& tag) {
  const auto id = entry.read_at(key, [](const YamlCursor& value) { return value.integer(0, 1'000'000); });
  if (!id) return tl::unexpected(id.error());
  tag = {family, static_cast<int>(*id)};
  return {};
}

Status read_fault_values(const YamlCursor& entry, Fault& fault) {
  internal::Numbers value(entry);
  fault.at_s = value.optional_within("at_s", 0, 0, internal::kOutOfProportion);
  fault.for_s = value.optional_positive("for_s", fault.for_s);
  if (fault.kind == FaultKind::TagMoved) {
    fault.shift_m = {value.optional("x_m", 0), value.optional("y_m", 0), value.optional("z_m", 0)};
    fault.turn_rad = to_radians(value.optional("turn_deg", 0));
  } else if (fault.kind == FaultKind::TagDuplicated) {
    fault.map_T_copy =
        upright_tag({value("x_m"), value("y_m"), value("z_m")}, to_radians(value("facing_deg")));
  } else if (fault.kind == FaultKind::Kidnapped) {
    fault.base_T_put = SE2(value.optional("forward_m", 0), value.optional("left_m", 0),
                           to_radians(value.optional("turn_deg", 0)));
  } else if (fault.kind == FaultKind::Carried) {
    fault.carry = {value.optional("forward_m_s", 0), value.optional("left_m_s", 0),
                   to_radians(value.optional("turn_deg_s", 0))};
  } else if (fault.kind == FaultKind::BatterySag) {
    fault.speed_share = value.optional_within("speed_share", 1, 0, 1);
  } else if (fault.kind == FaultKind::ClockJump) {
    fault.jump_s = value("jump_s");
  } else if (fault.kind == FaultKind::SlipBurst) {
    fault.speed_share = value.optional_within("speed_share", 1, 0, 1);
    fault.yaw_share = value.optional_within("yaw_share", 1, 0, 1);
  }
  return value.status();
}

Result<Fault> read_fault(const YamlCursor& entry, const World& world) {
  const Result<FaultKind> kind = kind_of(entry);
  if (!kind) return tl::unexpected(kind.error());
  std::vector<std::string> keys = keys_of(*kind);
  const bool about_tags = std::ranges::find(keys, "id") != keys.end();
  keys.insert(keys.begin(), {"fault", "at_s"});
  if (!at_one_moment(*kind)) keys.emplace_back("for_s");
  Fault fault{.kind = *kind};
  Status status = entry.check_keys(keys);
  if (status && about_tags) status = read_swapped_tag(entry, "id", world.anchor.family, fault.tag);
  if (status && *kind == FaultKind::TagsSwapped)
    status = read_swapped_tag(entry, "with_id", world.anchor.family, fault.other);
  if (status) status = read_fault_values(entry, fault);
  if (status) {
    status = check({&fault, 1}, world);
    if (!status) return entry.fail_here(status.error().code, status.error().message, status.error().hint);
  }
  if (!status) return tl::unexpected(status.error());
  return fault;
}

}  // namespace

Result<std::vector<Fault>> parse_faults(std::string_view text, const std::string& source,
                                        const World& world) {
  const Result<YamlNode> tree = parse_yaml(text, source, kFaultLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos)
    return fail(ErrorCode::InvalidArgument, "the file is empty", {.source = source},
                "Write faults: and entries below it, for example - {fault: camera_lost, at_s: 16, "
                "for_s: 1}.");
  if (Status status = root.check_keys({"faults"}); !status) return tl::unexpected(status.error());
  const Result<YamlCursor> list = root.at("faults");
  if (!list) return tl::unexpected(list.error());
  std::vector<Fault> faults;
  for (const YamlCursor& entry : list->children()) {
    const Result<Fault> fault = read_fault(entry, world);
    if (!fault) return tl::unexpected(fault.error());
    faults.push_back(*fault);
  }
  return faults;
}

Result<std::vector<Fault>> read_faults(const std::filesystem::path& path, const World& world) {
  const Result<std::string> text = read_text_file(path, kFaultLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_faults(*text, path.string(), world);
}

}  // namespace waymark
