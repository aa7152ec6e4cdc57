#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/runtime/commission_readings.hpp"

namespace waymark {

/// How a reading compares with what was commanded.
struct ReadingClass {
  enum class Kind : std::uint8_t { Fits, OtherUnit, OtherSize, Still };
  Kind kind = Kind::Fits;
  bool reversed = false;
  double factor = 1;      ///< of another unit
  const char* unit = "";  ///< "degrees instead of radians"

  [[nodiscard]] bool right() const { return kind == Kind::Fits && !reversed; }
  friend bool operator==(const ReadingClass& a, const ReadingClass& b) {
    return a.kind == b.kind && a.reversed == b.reversed && a.factor == b.factor;
  }
};

/// From 0.2 to 3 times what was commanded it fits: a robot that skids turns by a third of it. A unit is
/// recognised within the same bounds, the nearest factor where two would do.
[[nodiscard]] ReadingClass classify(const MotionReading& reading);

/// "is reversed, in degrees instead of radians"; empty when it is right.
[[nodiscard]] std::string words_of(const ReadingClass& found);

/// What the readings say together.
struct ReadingVerdict {
  bool command_wrong = false;  ///< all readings agree, and at least two origins made them
  bool either = false;         ///< one origin alone says so: it, or the command
  double size = 1;             ///< ratio of what happened to what was commanded; tags before the others
};
[[nodiscard]] ReadingVerdict compare(const std::vector<MotionReading>& readings);

}  // namespace waymark
