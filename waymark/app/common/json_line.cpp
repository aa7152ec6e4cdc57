#include "waymark/app/common/json_line.hpp"

#include <nlohmann/json.hpp>

namespace waymark {

nlohmann::ordered_json to_json(const Error& error) {
  nlohmann::ordered_json value;
  value["code"] = to_string(error.code);
  value["message"] = error.message;
  if (!error.place.source.empty()) value["source"] = error.place.source;
  if (error.place.line) value["line"] = *error.place.line;
  if (error.place.byte) value["byte"] = *error.place.byte;
  if (!error.place.key.empty()) value["key"] = error.place.key;
  if (!error.hint.empty()) value["hint"] = error.hint;
  return value;
}

std::string json_line(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace waymark
