// Any bytes as an option file: accepted options are within their ranges and round-trip.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/config/yaml_fields.hpp"

namespace {

struct Lap {
  double speed_m_s = 0.5;
  bool enabled = true;
  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s, waymark::Field{"v", "Speed.", 0, 2});
    visit(self.enabled, waymark::Field{"on", "Whether at all."});
  }
  friend bool operator==(const Lap&, const Lap&) = default;
};

struct Options {
  std::string name = {};
  int count = 1;
  std::vector<double> sizes_m = {};
  std::vector<Lap> laps = {};
  std::optional<std::int64_t> seed = {};
  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.name, waymark::Field{"name", "A name."});
    visit(self.count, waymark::Field{"n", "How many.", 1, 10});
    visit(self.sizes_m, waymark::Field{"s", "Sizes.", 0, 10});
    visit(self.laps, waymark::Field{"laps", "One a lap."});
    visit(self.seed, waymark::Field{"seed", "A seed."});
  }
  friend bool operator==(const Options&, const Options&) = default;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto options = waymark::parse_fields<Options>(text, "fuzz");
  if (!options) return 0;
  if (!waymark::check_ranges(*options)) std::abort();
  const auto again = waymark::parse_fields<Options>(waymark::write_fields(*options), "written");
  if (!again || !(*again == *options)) std::abort();
  return 0;
}
