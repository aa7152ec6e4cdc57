#include "waymark/runtime/commission_class.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"

namespace waymark {
namespace {

constexpr double kLeast = 0.2;
constexpr double kMost = 3;
constexpr double kStill = 0.004;

struct Factor {
  double factor;
  const char* unit;
};
const Factor kLengths[] = {{1000, "millimetres instead of metres"}, {100, "centimetres instead of metres"}};
const Factor kAngles[] = {{180 / M_PI, "degrees instead of radians"},
                          {M_PI / 180, "a 57th: radians taken for degrees"}};

std::span<const Factor> factors_of(ReadingUnit unit) {
  return unit == ReadingUnit::Length ? std::span<const Factor>(kLengths) : std::span<const Factor>(kAngles);
}

bool fits(double ratio) { return ratio >= kLeast && ratio <= kMost; }

}  // namespace

ReadingClass classify(const MotionReading& reading) {
  using Kind = ReadingClass::Kind;
  const double size = std::abs(reading.ratio);
  ReadingClass found{.reversed = reading.ratio < 0};
  if (!(size >= kStill)) return {.kind = Kind::Still};
  if (fits(size)) return found;
  found.kind = Kind::OtherSize;
  double nearest = std::log(kMost) * 2;
  for (const Factor& one : factors_of(reading.unit)) {
    const double away = std::abs(std::log(size / one.factor));
    if (!fits(size / one.factor) || away >= nearest) continue;
    nearest = away;
    found = {.kind = Kind::OtherUnit, .reversed = found.reversed, .factor = one.factor, .unit = one.unit};
  }
  return found;
}

std::string words_of(const ReadingClass& found) {
  using Kind = ReadingClass::Kind;
  std::string words;
  if (found.kind == Kind::Still) return "does not move";
  if (found.reversed) words = "is reversed";
  if (found.kind == Kind::OtherUnit)
    words += (words.empty() ? "is in " : ", and in ") + std::string(found.unit);
  if (found.kind == Kind::OtherSize)
    words += (words.empty() ? "" : ", and ") + std::string("is out of proportion");
  return words;
}

ReadingVerdict compare(const std::vector<MotionReading>& readings) {
  ReadingVerdict verdict;
  std::set<std::string> origins;
  std::vector<double> sizes;
  std::vector<ReadingClass> classes;
  for (const MotionReading& reading : readings) {
    origins.insert(reading.origin);
    classes.push_back(classify(reading));
    if (!classes.back().right()) continue;
    sizes.push_back(reading.ratio);
    if (reading.origin == "tags") verdict.size = reading.ratio;
  }
  if (!sizes.empty()) {
    if (verdict.size == 1) verdict.size = median(sizes);
    return verdict;
  }
  if (classes.empty()) return verdict;
  const bool agree =
      std::ranges::all_of(classes, [&](const ReadingClass& c) { return c == classes.front(); });
  verdict.command_wrong = agree && origins.size() > 1;
  verdict.either = agree && origins.size() == 1;
  return verdict;
}

}  // namespace waymark
