#include "waymark/runtime/frame_order.hpp"

#include <type_traits>
#include <variant>

#include <fmt/format.h>

namespace waymark {
namespace {

const std::string* camera_of(const Sample& sample) {
  return std::visit(
      [](const auto& value) -> const std::string* {
        if constexpr (requires { value.camera; }) return &value.camera;
        return nullptr;
      },
      sample);
}

}  // namespace

bool FrameOrder::pass(const Sample& sample) {
  constexpr Duration kJump = std::chrono::seconds(1);
  const std::string* camera = camera_of(sample);
  if (camera == nullptr) return true;
  const SensorTime stamp = stamp_of(sample);
  const auto [entry, is_first] = newest_.try_emplace({sample.index(), *camera}, stamp);
  const Duration behind = entry->second - stamp;
  if (is_first || behind <= Duration(0) || behind > kJump) {
    entry->second = stamp;
    return true;
  }
  ++left_out_;
  if ((left_out_ & (left_out_ - 1)) == 0)
    words_ = fmt::format(
        "{} picture{} of the camera '{}' {} left out: stamped {:.3f} s before an earlier one", left_out_,
        left_out_ == 1 ? "" : "s", *camera, left_out_ == 1 ? "was" : "were", to_seconds(behind));
  return false;
}

}  // namespace waymark
