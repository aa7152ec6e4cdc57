#include "waymark/drivers/process/drop_words.hpp"

#include <fmt/format.h>

namespace waymark {

std::string drop_words(std::uint64_t count, std::string_view topic, std::string_view why) {
  std::uint64_t unit = count;
  while (unit >= 10 && unit % 10 == 0) unit /= 10;
  if (unit != 1 && unit != 3) return {};
  return fmt::format("{} message{} of {} {} dropped, the last one: {}", count, count == 1 ? "" : "s", topic,
                     count == 1 ? "was" : "were", why);
}

}  // namespace waymark
