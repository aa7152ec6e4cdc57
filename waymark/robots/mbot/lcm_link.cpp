#include "waymark/robots/mbot/lcm_link.hpp"

#include <algorithm>
#include <cerrno>
#include <deque>

#include <fmt/format.h>

#include "waymark/robots/mbot/liblcm.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

#ifdef WAYMARK_HAVE_LCM

namespace {

constexpr int kMostWaiting = 1000;

class UdpLink final : public LcmLink {
 public:
  explicit UdpLink(const internal::Liblcm& lcm) : lcm_(lcm) {}
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

  const internal::Liblcm& lcm_;
  lcm_t* handle_ = nullptr;
  std::deque<LcmMessage> waiting_{};
};

}  // namespace

Result<std::unique_ptr<LcmLink>> open_lcm(const std::string& address) {
  const auto checked = lcm_address(address);
  if (!checked) return tl::unexpected(checked.error());
  const auto lcm = internal::liblcm();
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

}  // namespace waymark
