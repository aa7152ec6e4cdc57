#include "waymark/robots/process/message_fields.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/base/message_text.hpp"

namespace waymark {

using nlohmann::json;

MessageFields::MessageFields(RobotMessageReader& reader, const json& object, std::string type,
                             std::int64_t line)
    : reader_(reader), object_(object), type_(std::move(type)), line_(line) {}

void MessageFields::wrong(const std::string& key, const std::string& words, const std::string& hint) {
  if (status_)
    status_ = fail(ErrorCode::Unreadable, words,
                   {.source = reader_.name_, .line = line_, .key = type_ + "." + key}, hint);
}

const json* MessageFields::find(const char* key, bool needed) {
  taken_.insert(key);
  const auto found = object_.find(key);
  if (found != object_.end()) return &*found;
  if (needed) {
    std::vector<std::string> there;
    for (const auto& [name, value] : object_.items()) {
      if (name != "type") there.push_back(name);
    }
    const std::string near = nearest_word(key, there);
    wrong(key, "is missing", near.empty() ? "" : fmt::format("There is '{}': keys carry their unit.", near));
  }
  return nullptr;
}

bool MessageFields::has(const char* key) { return find(key, false) != nullptr; }

double MessageFields::checked(const json& value, const char* key, double least, double most) {
  const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!value.is_number())
    wrong(key, fmt::format("is not a number but {}", value.dump().substr(0, 40)));
  else if (!(number >= least && number <= most))
    wrong(key, fmt::format("{} is outside [{}, {}]", number, least, most));
  else
    return number;
  return 0;
}

double MessageFields::number(const char* key, double least, double most) {
  const json* value = find(key, true);
  return value == nullptr ? 0 : checked(*value, key, least, most);
}

double MessageFields::number_or(const char* key, double least, double most, double otherwise) {
  const json* value = find(key, false);
  return value == nullptr ? otherwise : checked(*value, key, least, most);
}

std::int64_t MessageFields::integer(const char* key, std::int64_t least, std::int64_t most) {
  const json* value = find(key, true);
  if (value == nullptr) return 0;
  if (!value->is_number_integer() || value->get<std::int64_t>() < least ||
      value->get<std::int64_t>() > most) {
    wrong(key, fmt::format("is not a whole number from {} to {} but {}", least, most,
                           value->dump().substr(0, 40)));
    return 0;
  }
  return value->get<std::int64_t>();
}

std::string MessageFields::text(const char* key, bool needed) {
  const json* value = find(key, needed);
  if (value == nullptr) return {};
  if (value->is_string()) return value->get<std::string>();
  wrong(key, fmt::format("is not text but {}", value->dump().substr(0, 40)));
  return {};
}

bool MessageFields::flag_or_false(const char* key) {
  const json* value = find(key, false);
  if (value == nullptr) return false;
  if (!value->is_boolean()) wrong(key, "is neither true nor false");
  return value->is_boolean() && value->get<bool>();
}

std::string MessageFields::camera() {
  const std::vector<std::string>& known = reader_.cameras_;
  const bool named = has("camera");
  std::string name = named ? text("camera") : std::string();
  if (!named && known.size() < 2) return known.empty() ? "cam" : known.front();
  if (known.empty() || std::ranges::find(known, name) != known.end()) return name;
  unknown_camera_ = true;
  leave_out(fmt::format("{}; the robot has {}",
                        named ? fmt::format("there is no camera '{}'", name) : "no camera is named",
                        fmt::join(known, ", ")));
  return name;
}

SensorTime MessageFields::stamp(const std::string& camera) {
  constexpr std::int64_t kMost_ns = std::int64_t{1} << 62U;
  constexpr double kMost_s = 4e9;
  SensorTime stamp{};
  if (has("stamp_ns"))
    stamp = SensorTime(Duration(integer("stamp_ns", 0, kMost_ns)));
  else
    stamp = SensorTime(Duration(std::llround(number("stamp_s", 0, kMost_s) * 1e9)));
  if (!status_) return stamp;
  auto& newest = reader_.newest_.try_emplace(type_ + "/" + camera, stamp).first->second;
  if (stamp < newest)
    wrong("stamp_s",
          fmt::format("the robot's clock went back by {:.3f} s since the last line of this type",
                      to_seconds(newest - stamp)),
          "Stamp with a steady clock (time.monotonic() in Python).");
  newest = stamp;
  return stamp;
}

const json* MessageFields::array(const char* key, std::size_t most) {
  const json* value = find(key, true);
  if (value == nullptr) return nullptr;
  if (value->is_array() && value->size() <= most) return value;
  wrong(key, value->is_array() ? fmt::format("has {} entries, more than {}", value->size(), most)
                               : std::string("is not a list"));
  return nullptr;
}

std::vector<double> MessageFields::numbers(const char* key, std::size_t most, bool holes) {
  constexpr double kAnything = 1e12;
  std::vector<double> numbers;
  const json* list = array(key, most);
  if (list == nullptr) return numbers;
  for (const json& value : *list) {
    if (holes && value.is_null())
      numbers.push_back(std::numeric_limits<double>::infinity());
    else
      numbers.push_back(checked(value, key, -kAnything, kAnything));
  }
  return numbers;
}

Status MessageFields::finish() {
  if (!status_) return status_;
  for (const auto& [key, value] : object_.items()) {
    if (!taken_.contains(key))
      reader_.warn_once(fmt::format("line {}: '{}' of {} is not known and passed over", line_, key, type_));
  }
  return {};
}

}  // namespace waymark
