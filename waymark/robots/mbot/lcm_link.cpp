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

/// The functions of liblcm that are used here, looked up when first needed.
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
  return fail(ErrorCode::Unsupported, "robots on LCM need liblcm: " + library.missing(), {.source = "LCM"},
              "Install it: sudo apt install liblcm1");
}

/// The library, loaded by the first call and then kept. Unsupported where it is missing: the error names the
/// package. May be called from any thread.
Result<const Liblcm*> liblcm() {
  static const Result<Liblcm> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

constexpr int kMostWaiting = 1000;

class UdpLink final : public LcmLink {
 public:
  explicit UdpLink(const Liblcm& lcm) : lcm_(lcm) {}
  ~UdpLink() override {
    if (handle_ != nullptr) lcm_.lcm_destroy(handle_);
  }

  Status join(const std::string& address) {
    handle_ = lcm_.lcm_create(address.c_str());
    if (handle_ != nullptr) return {};
    return fail(ErrorCode::Unsupported, fmt::format("{} cannot be joined", address), {.source = "LCM"},
                "Is there a route for multicast? Without a network: sudo ip route add 224.0.0.0/4 dev lo");
  }

  Status subscribe(const std::string& channels) override {
    auto* subscription = lcm_.lcm_subscribe(handle_, channels.c_str(), &UdpLink::receive, this);
    if (subscription == nullptr)
      return fail(ErrorCode::Unsupported, "nothing can be received", {.source = "LCM", .key = channels},
                  "Is there a route for multicast?");
    (void)lcm_.lcm_subscription_set_queue_capacity(subscription, kMostWaiting);
    return {};
  }

  Status publish(const std::string& channel, ByteSpan payload) override {
    constexpr std::size_t kMost = std::size_t{1} << 28U;
    if (payload.size() <= kMost && lcm_.lcm_publish(handle_, channel.c_str(), payload.data(),
                                                    static_cast<unsigned>(payload.size())) == 0)
      return {};
    return fail(ErrorCode::Unwritable, fmt::format("a message of {} bytes cannot be sent", payload.size()),
                {.source = "LCM", .key = channel}, "Is the network up?");
  }

  Result<std::optional<LcmMessage>> next(Duration most) override {
    if (waiting_.empty()) {
      const auto ms = std::chrono::ceil<std::chrono::milliseconds>(most).count();
      errno = 0;
      const bool failed = lcm_.lcm_handle_timeout(handle_, static_cast<int>(ms)) < 0;
      if (failed && errno != EINTR)  // Ctrl-C: whoever asks sees it
        return fail(ErrorCode::Unreadable, "the network is gone", {.source = "LCM"});
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

/// Nothing where the digits are more than `most`.
bool at_most(const std::string& digits, unsigned long most) {
  unsigned long value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size() && value <= most;
}

}  // namespace

Result<std::string> lcm_address(const std::string& text) {
  if (text.empty()) return std::string(kLcmDefaultAddress);
  const auto wrong = [&](const std::string& words) {
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' {}", text, words), {.key = "address"},
                fmt::format("For example {}; ttl=1 reaches the local network.", kLcmDefaultAddress));
  };
  static const std::regex kForm(
      R"(udpm://(\d{1,3})\.(\d{1,3})\.(\d{1,3})\.(\d{1,3}):(\d{1,5})(\?ttl=(\d{1,3}))?)");
  std::smatch parts;
  constexpr std::size_t kLongest = 100;
  if (text.size() > kLongest || !std::regex_match(text, parts, kForm))
    return wrong("is no address of UDP multicast");
  constexpr unsigned long kByte = 255;
  for (std::size_t i = 1; i <= 4; ++i)
    if (!at_most(parts[i], kByte)) return wrong("has a number above 255 in its address");
  const int first = std::stoi(parts[1]);
  constexpr int kFirstMulticast = 224;
  constexpr int kLastMulticast = 239;
  if (first < kFirstMulticast || first > kLastMulticast)
    return wrong("is no multicast address: those begin with 224 to 239");
  constexpr unsigned long kPorts = 65535;
  if (!at_most(parts[5], kPorts) || std::stoi(parts[5]) == 0) return wrong("has a port that is none");
  if (parts[7].matched && !at_most(parts[7], kByte)) return wrong("has a ttl above 255");
  return text;
}

void Presence::publish(LcmLink& link, const char* channel) {
  constexpr Duration kPeriod = std::chrono::milliseconds(100);
  const Duration now = steady_now();
  if (now < next_) return;
  next_ = now + kPeriod;
  const std::string name = name_of_this_process();
  const Bytes payload(name.begin(), name.end());
  (void)link.publish(channel, payload);  // what is not sent now is said again soon
}

Status no_mbot_at(const std::string& address) {
  constexpr Duration kListen = std::chrono::milliseconds(400);
  const auto link = open_lcm(address);
  if (!link) return tl::unexpected(link.error());
  if (Status status = (*link)->subscribe("MBOT_ODOMETRY|WAYMARK_SIMULATOR"); !status) return status;
  std::string who;
  bool heard = false;
  const Duration until = steady_now() + kListen;
  while (steady_now() < until) {
    const auto message = (*link)->next(until - steady_now());
    if (!message) return tl::unexpected(message.error());
    if (!*message) continue;
    heard = true;
    if ((*message)->channel == kSimulatorChannel) who = ": " + presence_of((*message)->payload);
  }
  if (!heard) return {};
  return fail(
      ErrorCode::InvalidArgument, "an MBot sends its odometry at this address already" + who,
      {.source = address},
      "End it, or name another port: udpm://239.255.76.67:7668?ttl=0, and the same in `robot=mbot:`.");
}

std::string presence_of(ByteSpan payload) {
  constexpr std::size_t kMost = 120;
  const auto shown = payload.first(std::min(payload.size(), kMost));
  return printable(std::string(shown.begin(), shown.end()));
}

}  // namespace waymark
