#include "waymark/robots/wire/wire_loop.hpp"

#include <optional>
#include <utility>

#include "waymark/robots/process/command_sender.hpp"

namespace waymark {

std::vector<std::string> SilenceReports::take_reports(Duration silent, bool listens) {
  std::vector<std::string> due;
  if (silent <= pause_) reported_.assign(reports_.size(), false);
  for (std::size_t i = 0; silent > pause_ && i < reports_.size(); ++i) {
    const Report& report = reports_[i];
    if (reported_[i] || silent <= report.after) continue;
    reported_[i] = true;
    due.push_back(listens && !report.text_listening.empty() ? report.text_listening : report.text);
  }
  return due;
}

/// The command input. Nothing is sent before begin().
class WireLoop::Orders {
 public:
  explicit Orders(const RobotWire& wire) : wire_(wire), early_(wire) {}

  void begin(WireLoop& loop) {
    if (!sender_)
      sender_.emplace([&loop](const VelocityCommand& command) { loop.send(command); }, wire_, early_.role());
  }
  /// Before the hello, only a bye ends the process, because input from /dev/null ends immediately.
  [[nodiscard]] bool over(bool greeted) {
    return sender_ ? sender_->ended() && (greeted || sender_->received_bye()) : early_.received_bye();
  }
  [[nodiscard]] bool ended() const { return sender_ && sender_->ended(); }
  [[nodiscard]] InputRole role() const { return sender_ ? sender_->role() : early_.role(); }
  void hold(bool held) {
    if (sender_) sender_->hold(held);
  }

 private:
  const RobotWire& wire_;
  EarlyInput early_;
  std::optional<CommandSender> sender_{};
};

Status WireLoop::run() {
  Orders orders(wire_);
  if (options_.commands_before_hello) orders.begin(*this);
  role_ = orders.role();
  began_ = now_();
  while (output_.open() && !orders.over(greeted()) && !wire_.should_stop()) {
    if (Status polled = poll_robot(); !polled) return polled;
    role_ = orders.role();
    input_ended_ = orders.ended();
    if (!greeted())
      if (Status status = greet(orders); !status) return status;
    const Duration now = now_();
    orders.hold(must_hold(now));
    for (const std::string& text : silence_reports(now))
      if (!text.empty()) output_.report(text);
    if (Status status = run_checks(); !status) return status;
  }
  return {};
}

Status WireLoop::greet(Orders& orders) {
  const auto is_ready = ready();
  if (!is_ready) return tl::unexpected(is_ready.error());
  if (!*is_ready) return {};
  if (Status status = prepare(); !status) return status;
  output_.greet(hello());
  after_hello();
  orders.begin(*this);
  return {};
}

Status WireLoop::run_checks() {
  const Duration now = now_();
  if (now < next_check_) return {};
  next_check_ = now + options_.check_period;
  if (Status status = check(); !status) return status;
  return waits() ? wait_for_robot(now - began_) : Status{};
}

Status WireLoop::wait_for_robot(Duration waited) {
  const bool gives_up = waited >= options_.give_up_after;
  if (waited < options_.report_after || (reported_ && !options_.report_again && !gives_up)) return {};
  reported_ = true;
  const NoContact contact = no_contact();
  if (gives_up) return contact.gave_up;
  output_.report_once(contact.report);
  return {};
}

}  // namespace waymark
