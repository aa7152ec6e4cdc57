#include "waymark/app/common/report_fields.hpp"

#include <nlohmann/json.hpp>

namespace waymark {
namespace {

nlohmann::ordered_json json_of(const ReportValue& value) {
  using Json = nlohmann::ordered_json;
  return std::visit(
      [](const auto& content) -> Json {
        using T = std::remove_cvref_t<decltype(content)>;
        if constexpr (std::same_as<T, std::monostate>) {
          return nullptr;
        } else if constexpr (std::same_as<T, ReportFields>) {
          return to_json(content);
        } else if constexpr (std::same_as<T, ReportValue::List>) {
          Json list = Json::array();
          for (const ReportValue& item : content) list.push_back(json_of(item));
          return list;
        } else {
          return content;
        }
      },
      value.content());
}

template <class T>
std::optional<T> known(const T& value) {
  return value.empty() ? std::nullopt : std::optional(value);
}

}  // namespace

// Defined here, where ReportField is a complete type.
ReportValue::ReportValue() = default;
ReportValue::ReportValue(const ReportValue& other) = default;
ReportValue::ReportValue(ReportValue&& other) noexcept = default;
ReportValue& ReportValue::operator=(const ReportValue& other) = default;
ReportValue& ReportValue::operator=(ReportValue&& other) noexcept = default;
ReportValue::~ReportValue() = default;

ReportFields ReportValue::keys() const {
  if (const auto* object = std::get_if<ReportFields>(&content_)) return *object;
  const auto* list = std::get_if<List>(&content_);
  return list != nullptr && !list->empty() ? list->front().keys() : keys_;
}

ReportFields fields(const Error& error) {
  return {{"code", "Kind of the error", to_string(error.code)},
          {"message", "What is wrong", error.message},
          {"source", "File or device", if_any(known(error.place.source))},
          {"line", "Line of the file", if_any(error.place.line)},
          {"byte", "Byte of the file", if_any(error.place.byte)},
          {"key", "Key or field", if_any(known(error.place.key))},
          {"hint", "What to do", if_any(known(error.hint))}};
}

nlohmann::ordered_json to_json(const ReportFields& fields) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  for (const ReportField& field : fields)
    if (!field.value.is_left_out()) object[field.name] = json_of(field.value);
  return object;
}

std::string json_line(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string json_line(const ReportFields& fields) { return json_line(to_json(fields)); }

std::string json_text(const ReportFields& fields) {
  return to_json(fields).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace waymark
