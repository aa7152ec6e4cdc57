#include "waymark/robots/limo/command_gate.hpp"

#include <cmath>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr Duration kSilence = std::chrono::milliseconds(250);
constexpr Duration kAskEvery = std::chrono::milliseconds(200);
constexpr Duration kAskAgainEvery = std::chrono::seconds(1);

bool same(const LimoState& a, const LimoState& b) {
  return a.vehicle == b.vehicle && a.commanded == b.commanded && a.errors == b.errors && a.drive == b.drive;
}

/// Tracks are driven as wheels are.
bool same_drive(LimoDrive said, LimoDrive file) {
  const bool turns_on_the_spot = said != LimoDrive::Ackermann;
  return turns_on_the_spot == (file != LimoDrive::Ackermann);
}

}  // namespace

LimoDrive CommandGate::drive() const { return state_ ? state_->drive : file_; }

void CommandGate::stop(const std::string& why) {
  if (!stopped_ && obeyed_) words_.push_back(why + ": zero is sent, until the driver has asked for zero");
  stopped_ = true;
}

void CommandGate::say_errors(std::uint16_t errors) {
  const auto fresh = static_cast<std::uint16_t>(errors & ~said_errors_);
  for (const std::string& word : error_words(fresh)) words_.push_back("LIMO says that " + word);
  said_errors_ = errors;
}

void CommandGate::hear(const LimoMotion& motion, Duration now) {
  constexpr double kStanding = 0.02;
  stands_ = std::abs(motion.speed_m_s) < kStanding && std::abs(motion.yaw_rate_rad_s) < kStanding;
  motion_heard_ = now;
  if (silent_) words_.emplace_back("LIMO is heard again");
  silent_ = false;
}

void CommandGate::hear(const LimoState& state, Duration /*now*/) {
  // One frame in 256 damaged ones has the right checksum; two in a row that say the same are believed.
  const bool believed = (state_ && same(*state_, state)) || (doubtful_ && same(*doubtful_, state));
  doubtful_ = state;
  if (!believed) return;
  state_ = state;
  say_errors(state.errors);
  if (!same_drive(state.drive, file_))
    stop(fmt::format("LIMO drives as {}, its file describes one that is {}", to_string(state.drive),
                     to_string(file_)));
  if (state.vehicle == LimoState::Vehicle::EmergencyStop) stop("LIMO is in emergency stop");
  if (state.vehicle == LimoState::Vehicle::Exception) stop("LIMO reports an exception");
  if ((state.errors & kLimoStoppingErrors) != 0) stop("LIMO reports an error of its motors or its steering");
  if (!state.commanded) stop("the remote control has taken LIMO over, or LIMO was switched off and on");
  if (state.commanded && !obeyed_) {
    obeyed_ = true;
    stopped_ = stopped_ && !same_drive(state.drive, file_);
  }
}

VelocityCommand CommandGate::pass(const VelocityCommand& asked, Duration now) {
  asked_zero_ = asked == VelocityCommand{};
  if (motion_heard_ && now - *motion_heard_ > kSilence && !silent_) {
    silent_ = true;
    words_.emplace_back("nothing was heard of LIMO's motion for 0.25 s: zero is sent");
  }
  const bool sound = state_ && state_->commanded && same_drive(state_->drive, file_) &&
                     state_->vehicle == LimoState::Vehicle::Normal &&
                     (state_->errors & kLimoStoppingErrors) == 0;
  if (sound && asked_zero_ && std::exchange(stopped_, false)) words_.emplace_back("LIMO obeys again");
  return sound && ready() && !stopped_ && !silent_ ? asked : VelocityCommand{};
}

bool CommandGate::asks_for_command(Duration now) {
  if (state_ && state_->commanded) return false;
  if (obeyed_ && !(asked_zero_ && stands_)) return false;
  if (asked_at_ && now - *asked_at_ < (obeyed_ ? kAskAgainEvery : kAskEvery)) return false;
  asked_at_ = now;
  return true;
}

}  // namespace waymark
