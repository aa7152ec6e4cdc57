#include "waymark/config/yaml/commission_record.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/fnv1a.hpp"
#include "waymark/config/yaml_tree.hpp"

namespace waymark {
namespace {

constexpr std::string_view kKey = "commissioned";

using Figure = std::pair<const char*, std::optional<double> CommissionFigures::*>;
constexpr std::array<Figure, 7> kFigures{{{"response_s", &CommissionFigures::response_s},
                                          {"stopping_s", &CommissionFigures::stopping_s},
                                          {"stopping_m", &CommissionFigures::stopping_m},
                                          {"silence_stopping_s", &CommissionFigures::silence_stopping_s},
                                          {"kill_stopping_s", &CommissionFigures::kill_stopping_s},
                                          {"speed_scale", &CommissionFigures::speed_scale},
                                          {"yaw_rate_scale", &CommissionFigures::yaw_rate_scale}}};

Status read_figures(const YamlCursor& entry, CommissionFigures& figures) {
  std::vector<std::string> known;
  known.reserve(kFigures.size());
  for (const auto& [name, member] : kFigures) known.emplace_back(name);
  if (Status status = entry.check_keys(known); !status) return status;
  internal::Numbers value(entry);
  for (const auto& [name, member] : kFigures) {
    if (entry.find(name)) figures.*member = value(name);
  }
  return value.status();
}

Status read_limits(const YamlCursor& entry, MotionLimits& limits) {
  internal::Numbers value(entry);
  limits = {.speed_m_s = value.positive("speed_m_s"),
            .yaw_rate_rad_s = value.positive("yaw_rate_rad_s"),
            .acceleration_m_s2 = value.positive("acceleration_m_s2"),
            .yaw_acceleration_rad_s2 = value.positive("yaw_acceleration_rad_s2")};
  return value.status();
}

Status read_wheels(const YamlCursor& entry, CommissionRecord& record) {
  internal::Numbers value(entry);
  record.wheel_radius_m = value.positive("radius_m");
  record.track_m = value.positive("track_m");
  return value.status();
}

Status read_words(const YamlCursor& entry, CommissionRecord& record) {
  for (const auto& [key, to] :
       {std::pair{"date", &record.date}, {"version", &record.version}, {"robot", &record.robot}}) {
    Result<std::string> text = entry.read_at(key, &YamlCursor::text);
    if (!text) return tl::unexpected(text.error());
    *to = std::move(*text);
  }
  if (const auto topics = entry.find("topics")) {
    Result<std::string> text = topics->text();
    if (!text) return tl::unexpected(text.error());
    record.topics = std::move(*text);
  }
  const auto failed = entry.find("failed");
  if (!failed) return {};
  for (const YamlCursor& one : failed->children()) {
    Result<std::string> text = one.text();
    if (!text) return tl::unexpected(text.error());
    record.failed.push_back(std::move(*text));
  }
  return {};
}

Result<CommissionRecord> read_record(const YamlCursor& entry) {
  CommissionRecord record;
  Status status = entry.check_keys(
      {"passed", "date", "version", "robot", "topics", "limits", "wheels", "failed", "figures"});
  if (!status) return tl::unexpected(status.error());
  const Result<bool> passed = entry.read_at("passed", &YamlCursor::boolean);
  if (!passed) return tl::unexpected(passed.error());
  record.passed = *passed;
  status = read_words(entry, record);
  const Result<YamlCursor> limits = entry.at("limits");
  const Result<YamlCursor> wheels = entry.at("wheels");
  if (status) status = limits ? read_limits(*limits, record.limits) : tl::unexpected(limits.error());
  if (status) status = wheels ? read_wheels(*wheels, record) : tl::unexpected(wheels.error());
  const auto figures = entry.find("figures");
  if (status && figures) status = read_figures(*figures, record.figures);
  if (!status) return tl::unexpected(status.error());
  return record;
}

std::string to_yaml(const CommissionRecord& record) {
  const auto n = yaml_number;
  std::string failed;
  for (const std::string& key : record.failed) failed += (failed.empty() ? "" : ", ") + yaml_text(key);
  std::string text = fmt::format(
      "{}:  # written by `waymark commission`\n  passed: {}\n  date: {}\n  version: {}\n  robot: {}\n", kKey,
      record.passed, yaml_text(record.date), yaml_text(record.version), yaml_text(record.robot));
  if (!record.topics.empty()) text += fmt::format("  topics: {}\n", yaml_text(record.topics));
  text += fmt::format("  failed: [{}]\n  figures:\n", failed);
  for (const auto& [name, member] : kFigures) {
    if (record.figures.*member) text += fmt::format("    {}: {:.4g}\n", name, *(record.figures.*member));
  }
  // Required keys are last, so that a record which was cut at the end of a line is rejected.
  return text + fmt::format(
                    "  limits: {{speed_m_s: {}, yaw_rate_rad_s: {}, acceleration_m_s2: {}, "
                    "yaw_acceleration_rad_s2: {}}}\n  wheels: {{radius_m: {}, track_m: {}}}\n",
                    n(record.limits.speed_m_s), n(record.limits.yaw_rate_rad_s),
                    n(record.limits.acceleration_m_s2), n(record.limits.yaw_acceleration_rad_s2),
                    n(record.wheel_radius_m), n(record.track_m));
}

/// Adds a block at the end of the file, but before its key `end`, which remains the last one.
std::string with_block(std::string text, const std::string& block) {
  const bool first = text.starts_with("end:");
  const std::size_t before = text.rfind("\nend:");
  if (!first && before == std::string::npos) return text + block;
  return text.insert(first ? 0 : before + 1, block);
}

/// The text without a key's top-level block.
std::string without_block(std::string_view text) {
  std::string kept;
  bool inside = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    if (line.starts_with(std::string(kKey) + ":"))
      inside = true;
    else if (inside && line.front() != ' ' && line.front() != '}' && line.front() != '\n')
      inside = false;
    if (!inside) kept += line;
  }
  if (!kept.empty() && kept.back() != '\n') kept += '\n';
  return kept;
}

}  // namespace

Result<std::optional<CommissionRecord>> parse_commission(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source);
  if (!tree) return tl::unexpected(tree.error());
  const auto entry = YamlCursor(*tree, source).find(kKey);
  if (!entry) return std::optional<CommissionRecord>();
  Result<CommissionRecord> record = read_record(*entry);
  if (!record) return tl::unexpected(record.error());
  return std::optional<CommissionRecord>(std::move(*record));
}

Result<std::string> with_commission(std::string_view text, const CommissionRecord& record) {
  const std::string changed = with_block(without_block(text), to_yaml(record));
  const auto back = parse_commission(changed, "robot.yaml");
  if (!back) return tl::unexpected(back.error());
  if (!*back || (*back)->date != record.date || (*back)->passed != record.passed)
    return fail(ErrorCode::Unsupported, "the layout of the file does not allow an automatic change",
                {.key = std::string(kKey)}, "Write each top-level key at the left margin of a line.");
  return changed;
}

std::vector<std::string> changes_since(const CommissionRecord& record, const RobotModel& model,
                                       const CommissionGround& ground) {
  std::vector<std::string> changes;
  const auto number = [&](const char* key, double then, double now) {
    constexpr double kSame = 1e-9;
    if (std::abs(then - now) > kSame * std::max(std::abs(then), std::abs(now)))
      changes.push_back(fmt::format("{} changed from {:g} to {:g}", key, then, now));
  };
  number("limits.speed_m_s", record.limits.speed_m_s, model.limits.speed_m_s);
  number("limits.yaw_rate_rad_s", record.limits.yaw_rate_rad_s, model.limits.yaw_rate_rad_s);
  number("limits.acceleration_m_s2", record.limits.acceleration_m_s2, model.limits.acceleration_m_s2);
  number("limits.yaw_acceleration_rad_s2", record.limits.yaw_acceleration_rad_s2,
         model.limits.yaw_acceleration_rad_s2);
  number("wheels.radius_m", record.wheel_radius_m, model.wheel_radius_m);
  number("wheels.track_m", record.track_m, model.track_m);
  if (record.robot != ground.robot)
    changes.push_back(fmt::format("`robot` changed from {} to {}", record.robot, ground.robot));
  else if (record.topics != ground.topics)
    changes.push_back("the profile of its topics has changed");
  return changes;
}

std::string digest_of(std::string_view text) {
  if (text.empty()) return {};
  return fmt::format("{:016x}", fnv1a(text));
}

}  // namespace waymark
