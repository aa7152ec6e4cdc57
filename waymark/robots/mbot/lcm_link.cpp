#include "waymark/robots/mbot/lcm_link.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <deque>
#include <regex>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

#ifdef WAYMARK_HAVE_LCM
#include <lcm/lcm.h>

#include "waymark/modules/load_module.hpp"
#endif

namespace waymark {

#ifdef WAYMARK_HAVE_LCM

namespace {

// clang-format off
#define WAYMARK_LCM(F)                                                                   \
  F(lcm_create) F(lcm_destroy) F(lcm_subscribe) F(lcm_subscription_set_queue_capacity)   \
  F(lcm_publish) F(lcm_handle_timeout)
// clang-format on

/// The functions from liblcm that are used here, looked up on first use.
struct Liblcm {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_LCM_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_LCM(WAYMARK_LCM_MEMBER)
#undef WAYMARK_LCM_MEMBER
};

Result<Liblcm> load() {
  SharedLibrary library("liblcm.so.1");
  Liblcm lcm;
#define WAYMARK_LCM_LOOK_UP(name) library.look_up(#name, lcm.name);
  WAYMARK_LCM(WAYMARK_LCM_LOOK_UP)
#undef WAYMARK_LCM_LOOK_UP
  if (library.missing().empty()) return lcm;
  return fail(ErrorCode::Unsupported, "LCM robots require liblcm: " + library.missing(), {.source = "LCM"},
              "Install it: sudo apt install liblcm1");
}

/// The library, loaded by the first call and kept from then on. Fails with Unsupported if it is missing; the
/// hint contains the package. May be called from any thread.
Result<const Liblcm*> liblcm() {
  static const Result<Liblcm> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

constexpr int kMaxQueuedMessages = 1000;

class UdpLink final : public LcmLink {
 public:
  explicit UdpLink(const Liblcm& lcm) : lcm_(lcm) {}
  ~UdpLink() override {
    if (handle_ != nullptr) lcm_.lcm_destroy(handle_);
  }

  Status join(const std::string& address) {
    handle_ = lcm_.lcm_create(address.c_str());
    if (handle_ != nullptr) return {};
    return fail(ErrorCode::Unsupported, fmt::format("cannot join {}", address), {.source = "LCM"},
                "Check the multicast route. Without a network: sudo ip route add 224.0.0.0/4 dev lo");
  }

  Status subscribe(const std::string& channels) override {
    auto* subscription = lcm_.lcm_subscribe(handle_, channels.c_str(), &UdpLink::receive, this);
    if (subscription == nullptr)
      return fail(ErrorCode::Unsupported, "cannot subscribe", {.source = "LCM", .key = channels},
                  "Check the multicast route.");
    (void)lcm_.lcm_subscription_set_queue_capacity(subscription, kMaxQueuedMessages);
    return {};
  }

  Status publish(const std::string& channel, ByteSpan payload) override {
    constexpr std::size_t kMaxPayload = std::size_t{1} << 28U;
    if (payload.size() <= kMaxPayload && lcm_.lcm_publish(handle_, channel.c_str(), payload.data(),
                                                          static_cast<unsigned>(payload.size())) == 0)
      return {};
    return fail(ErrorCode::Unwritable, fmt::format("cannot send a message of {} bytes", payload.size()),
                {.source = "LCM", .key = channel}, "Check that the network is up.");
  }

  Result<std::optional<LcmMessage>> next(Duration timeout) override {
    if (waiting_.empty()) {
      const auto ms = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
      errno = 0;
      const bool failed = lcm_.lcm_handle_timeout(handle_, static_cast<int>(ms)) < 0;
      if (failed && errno != EINTR)  // Ctrl-C is handled by the caller
        return fail(ErrorCode::Unreadable, "the network connection failed", {.source = "LCM"});
    }
    if (waiting_.empty()) return std::optional<LcmMessage>();
    std::optional<LcmMessage> message(std::move(waiting_.front()));
    waiting_.pop_front();
    return message;
  }

 private:
  static void receive(const lcm_recv_buf_t* buffer, const char* channel, void* self) {
    const auto* bytes = static_cast<const std::uint8_t*>(buffer->data);
    static_cast<UdpLink*>(self)->waiting_.push_back(
        {channel, Bytes(bytes, bytes + buffer->data_size), steady_now(), buffer->recv_utime});
  }

  const Liblcm& lcm_;
  lcm_t* handle_ = nullptr;
  std::deque<LcmMessage> waiting_{};
};

}  // namespace

Result<std::unique_ptr<LcmLink>> open_lcm(const std::string& address) {
  const auto checked = lcm_address(address);
  if (!checked) return tl::unexpected(checked.error());
  const auto lcm = liblcm();
  if (!lcm) return tl::unexpected(lcm.error());
  auto link = std::make_unique<UdpLink>(**lcm);
  if (Status status = link->join(*checked); !status) return tl::unexpected(status.error());
  return link;
}

#else

Result<std::unique_ptr<LcmLink>> open_lcm(const std::string& address) {
  if (const auto checked = lcm_address(address); !checked) return tl::unexpected(checked.error());
  return fail(ErrorCode::Unsupported, "this program was built without LCM", {.source = "LCM"},
              "Install liblcm-dev and build again.");
}

#endif

namespace {

/// Whether the digits form a number that is at most `max`.
bool at_most(const std::string& digits, unsigned long max) {
  unsigned long value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size() && value <= max;
}

}  // namespace

Result<std::string> lcm_address(const std::string& text) {
  if (text.empty()) return std::string(kLcmDefaultAddress);
  const auto wrong = [&](const std::string& reason) {
    return fail(
        ErrorCode::InvalidArgument, fmt::format("invalid address '{}': {}", text, reason), {.key = "address"},
        fmt::format("Use an address such as {}; ttl=1 reaches the local network.", kLcmDefaultAddress));
  };
  static const std::regex kForm(
      R"(udpm://(\d{1,3})\.(\d{1,3})\.(\d{1,3})\.(\d{1,3}):(\d{1,5})(\?ttl=(\d{1,3}))?)");
  std::smatch parts;
  constexpr std::size_t kMaxLength = 100;
  if (text.size() > kMaxLength || !std::regex_match(text, parts, kForm))
    return wrong("not of the form udpm://ADDRESS:PORT?ttl=N");
  constexpr unsigned long kByte = 255;
  for (std::size_t i = 1; i <= 4; ++i)
    if (!at_most(parts[i], kByte)) return wrong("its IPv4 address has a number above 255");
  const int first = std::stoi(parts[1]);
  constexpr int kFirstMulticast = 224;
  constexpr int kLastMulticast = 239;
  if (first < kFirstMulticast || first > kLastMulticast)
    return wrong("multicast addresses begin with 224 to 239");
  constexpr unsigned long kMaxPort = 65535;
  if (!at_most(parts[5], kMaxPort) || std::stoi(parts[5]) == 0) return wrong("its port is not in 1 to 65535");
  if (parts[7].matched && !at_most(parts[7], kByte)) return wrong("its ttl is above 255");
  return text;
}

void Presence::publish(LcmLink& link, const char* channel) {
  constexpr Duration kPeriod = std::chrono::milliseconds(100);
  const Duration now = steady_now();
  if (now < next_) return;
  next_ = now + kPeriod;
  const std::string name = name_of_this_process();
  const Bytes payload(name.begin(), name.end());
  (void)link.publish(channel, payload);  // best effort, because it is soon repeated
}

Status no_mbot_at(const std::string& address) {
  constexpr Duration kListen = std::chrono::milliseconds(400);
  const auto link = open_lcm(address);
  if (!link) return tl::unexpected(link.error());
  if (Status status = (*link)->subscribe("MBOT_ODOMETRY|WAYMARK_SIMULATOR"); !status) return status;
  std::string who;
  bool received = false;
  const Duration until = steady_now() + kListen;
  while (steady_now() < until) {
    const auto message = (*link)->next(until - steady_now());
    if (!message) return tl::unexpected(message.error());
    if (!*message) continue;
    received = true;
    if ((*message)->channel == kSimulatorChannel) who = ": " + presence_of((*message)->payload);
  }
  if (!received) return {};
  return fail(
      ErrorCode::InvalidArgument, "an MBot already sends odometry at this address" + who, {.source = address},
      "Stop it, or use another port, such as udpm://239.255.76.67:7668?ttl=0, here and in `robot=mbot:`.");
}

std::string presence_of(ByteSpan payload) {
  constexpr std::size_t kMaxNameBytes = 120;
  const auto shown = payload.first(std::min(payload.size(), kMaxNameBytes));
  return printable(std::string(shown.begin(), shown.end()));
}

}  // namespace waymark
