#include "waymark/robots/limo/command_gate.hpp"

#include <cmath>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr Duration kSilence = std::chrono::milliseconds(250);
constexpr Duration kRequestPeriod = std::chrono::milliseconds(200);
constexpr Duration kRepeatedRequestPeriod = std::chrono::seconds(1);

bool same(const LimoState& a, const LimoState& b) {
  return a.vehicle == b.vehicle && a.commanded == b.commanded && a.errors == b.errors && a.drive == b.drive;
}

/// Tracks, Mecanum wheels and differential drive accept the same commands.
bool same_drive(LimoDrive reported, LimoDrive file) {
  const bool turns_on_the_spot = reported != LimoDrive::Ackermann;
  return turns_on_the_spot == (file != LimoDrive::Ackermann);
}

}  // namespace

LimoDrive CommandGate::drive() const { return state_ ? state_->drive : file_; }

void CommandGate::stop(const std::string& why) {
  if (!stopped_ && obeyed_) pending_.push_back(why + ": sending zero until the driver has commanded zero");
  stopped_ = true;
}

void CommandGate::report_errors(std::uint16_t errors) {
  const auto fresh = static_cast<std::uint16_t>(errors & ~reported_errors_);
  for (const std::string& text : limo_error_texts(fresh)) pending_.push_back("LIMO reports: " + text);
  reported_errors_ = errors;
}

void CommandGate::receive(const LimoMotion& motion, Duration now) {
  constexpr double kMaxStationarySpeed = 0.02;  // m/s and rad/s
  stationary_ = std::abs(motion.speed_m_s) < kMaxStationarySpeed &&
                std::abs(motion.yaw_rate_rad_s) < kMaxStationarySpeed;
  motion_received_ = now;
  if (silent_) pending_.emplace_back("LIMO reports its motion again");
  silent_ = false;
}

void CommandGate::receive(const LimoState& state, Duration /*now*/) {
  // One in 256 damaged frames has a correct checksum, so a new state is accepted only after two equal frames.
  const bool accepted = (state_ && same(*state_, state)) || (unconfirmed_ && same(*unconfirmed_, state));
  unconfirmed_ = state;
  if (!accepted) return;
  state_ = state;
  report_errors(state.errors);
  if (!same_drive(state.drive, file_))
    stop(fmt::format("LIMO's drive is {}, but its robot file has {}", to_string(state.drive),
                     to_string(file_)));
  if (state.vehicle == LimoState::Vehicle::EmergencyStop) stop("LIMO is in emergency stop");
  if (state.vehicle == LimoState::Vehicle::Exception) stop("LIMO reports an exception");
  if ((state.errors & kLimoStoppingErrors) != 0) stop("LIMO reports an error of motors or steering");
  if (!state.commanded) stop("the remote control has taken over LIMO, or LIMO was restarted");
  if (state.commanded && !obeyed_) {
    obeyed_ = true;
    stopped_ = stopped_ && !same_drive(state.drive, file_);
  }
}

VelocityCommand CommandGate::pass(const VelocityCommand& asked, Duration now) {
  asked_zero_ = asked == VelocityCommand{};
  if (motion_received_ && now - *motion_received_ > kSilence && !silent_) {
    silent_ = true;
    pending_.emplace_back("no motion from LIMO for 0.25 s: sending zero");
  }
  const bool sound = state_ && state_->commanded && same_drive(state_->drive, file_) &&
                     state_->vehicle == LimoState::Vehicle::Normal &&
                     (state_->errors & kLimoStoppingErrors) == 0;
  if (sound && asked_zero_ && std::exchange(stopped_, false))
    pending_.emplace_back("LIMO accepts commands again");
  return sound && ready() && !stopped_ && !silent_ ? asked : VelocityCommand{};
}

bool CommandGate::asks_for_command(Duration now) {
  if (state_ && state_->commanded) return false;
  if (obeyed_ && !(asked_zero_ && stationary_)) return false;
  if (asked_at_ && now - *asked_at_ < (obeyed_ ? kRepeatedRequestPeriod : kRequestPeriod)) return false;
  asked_at_ = now;
  return true;
}

}  // namespace waymark
