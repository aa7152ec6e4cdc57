#include "waymark/server/live_hub.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

namespace waymark {

bool Outbox::put(OutFrame frame) {
  if (frame.newest_of) {
    const auto old = std::ranges::find(frames_, frame.newest_of, &OutFrame::newest_of);
    if (old != frames_.end()) {
      bytes_ -= old->size();
      frames_.erase(old);
      ++dropped_;
    }
  }
  bytes_ += frame.size();
  frames_.push_back(std::move(frame));
  while (too_much()) {
    const auto oldest = std::ranges::find(frames_, false, &OutFrame::must_arrive);
    if (oldest == frames_.end()) return false;
    bytes_ -= oldest->size();
    frames_.erase(oldest);
    ++dropped_;
  }
  return true;
}

std::optional<OutFrame> Outbox::next() {
  if (frames_.empty()) return std::nullopt;
  OutFrame frame = std::move(frames_.front());
  frames_.pop_front();
  bytes_ -= frame.size();
  return frame;
}

namespace {

constexpr std::size_t kMaxSubscriptions = 256;
/// A page sends a message every half second while its window is visible; other clients in control send or
/// publish something. Responses to pings do not show that a person is present.
constexpr Duration kSilence = std::chrono::seconds(3);
constexpr Duration kStatePeriod = std::chrono::milliseconds(200);
constexpr const char* kStateTopic = "/waymark/state";
constexpr std::uint32_t kControlMark = 0xffffffffU;  // larger than any channel ID

}  // namespace

std::string_view choose_protocol(std::string_view offered) {
  while (!offered.empty()) {
    const std::size_t comma = offered.find(',');
    std::string_view one = offered.substr(0, comma);
    while (one.starts_with(' ')) one.remove_prefix(1);
    while (one.ends_with(' ')) one.remove_suffix(1);
    if (one == kPageProtocol) return kPageProtocol;
    for (const std::string_view known : kFoxgloveProtocols) {
      if (one == known) return known;
    }
    offered.remove_prefix(comma == std::string_view::npos ? offered.size() : comma + 1);
  }
  return {};
}

std::optional<LiveHub::Id> LiveHub::join(std::string_view protocol, bool may_command, Duration now) {
  const auto watchers =
      std::ranges::count_if(clients_, [](const auto& one) { return !one.second.may_command; });
  if (clients_.size() >= kMaxClients) return std::nullopt;
  if (!may_command && static_cast<std::size_t>(watchers) >= kMaxWatchers) return std::nullopt;
  const Id id = next_id_++;
  Client& client = clients_[id];
  client.page = protocol == kPageProtocol;
  client.may_command = may_command;
  client.received = now;
  feed_.set_listening(true);
  put_text(client, server_info(name_));
  advertise(client);
  if (client.page) {
    send_control(id, client);
    send_texts(client);
  }
  return id;
}

void LiveHub::leave(Id id) {
  release(id, true);
  clients_.erase(id);
  if (clients_.empty()) feed_.set_listening(false);
}

void LiveHub::put(Client& client, OutFrame frame) {
  if (!client.outbox.put(std::move(frame))) client.lost = true;
}

void LiveHub::put_text(Client& client, std::string text, std::optional<std::uint32_t> newest_of) {
  put(client, {.text = true, .head = std::move(text), .newest_of = newest_of, .must_arrive = true});
}

void LiveHub::warn(Client& client, const std::string& words) {
  // This frame may be dropped, so that a viewer that keeps sending invalid messages does not fill its queue.
  put(client, {.text = true, .head = status_message(words)});
}

void LiveHub::advertise(Client& client) {
  const auto& known = channels_.known();
  if (client.advertised == known.size()) return;
  put_text(client, advertisement(std::span(known).subspan(client.advertised)));
  client.advertised = known.size();
}

void LiveHub::send(Client& client, const LiveMessage& message) {
  const LiveChannel& channel = channels_.known()[message.channel];
  for (const auto& [subscription, id] : client.channel_of) {
    if (id != message.channel) continue;
    put(client, {.head = message_head(subscription, message.host_ns),
                 .body = message.cdr,
                 .newest_of = channel.newest ? std::optional(subscription) : std::nullopt});
  }
}

std::set<std::uint32_t> LiveHub::wanted() const {
  std::set<std::uint32_t> all;
  for (const auto& [id, client] : clients_) {
    for (const auto& [subscription, channel] : client.channel_of) all.insert(channel);
  }
  return all;
}

void LiveHub::tick(Duration now) {
  LiveFeed::Updates updates = feed_.take();
  status_ = updates.status;
  texts_ = updates.texts;
  std::vector<LiveMessage> messages;
  if (updates.camera && !std::exchange(camera_told_, true))
    messages = channels_.encode(*updates.camera, now.count());
  if (updates.shapes && std::exchange(shapes_, updates.shapes) != updates.shapes)
    std::ranges::move(channels_.encode(*updates.shapes, now.count()), std::back_inserter(messages));
  const std::set<std::uint32_t> subscribed = wanted();
  for (LiveSample& sample : updates.samples) {
    auto* received = std::get_if<Sample>(&sample.value);
    if (received != nullptr) health_.receive(*received, Duration(sample.host_ns));
    std::ranges::move(channels_.encode(sample, subscribed), std::back_inserter(messages));
    auto* image = received != nullptr ? std::get_if<CameraFrame>(received) : nullptr;
    if (image != nullptr) feed_.give_back(std::move(*image));
  }
  for (auto& [id, client] : clients_) {
    advertise(client);
    for (const LiveMessage& message : messages) send(client, message);
    if (client.page) send_texts(client);
  }
  send_state(now);
  if (holder_ && now - clients_.at(*holder_).received > kSilence) release(*holder_, true);
}

void LiveHub::send_state(Duration now) {
  const bool due = !state_told_ || now - *state_told_ >= kStatePeriod || status_.phase != last_phase_;
  if (due) {
    state_told_ = now;
    last_phase_ = status_.phase;
    const LiveMessage message = channels_.encode_json(
        kStateTopic, state_json(status_, health_.lights(status_, now), feed_.dropped()), now.count());
    for (auto& [id, client] : clients_) {
      advertise(client);
      send(client, message);
    }
  }
  for (auto& [id, client] : clients_) {
    if (client.page) send_control(id, client);
  }
}

void LiveHub::send_control(Id id, Client& client) {
  std::string text = control_json({.may = client.may_command,
                                   .yours = holder_ == id,
                                   .held = holder_.has_value(),
                                   .viewers = clients_.size(),
                                   .dropped = client.outbox.dropped()});
  if (text == client.last_control) return;
  client.last_control = text;
  put_text(client, std::move(text), kControlMark);
}

void LiveHub::send_texts(Client& client) {
  if (client.texts_version == texts_->version) return;
  client.texts_version = texts_->version;
  for (const auto& [name, text] : texts_->by_name) put_text(client, text_message(name, text));
}

bool LiveHub::take(Id id, Client& client) {
  if (holder_ == id) return true;
  if (!client.may_command) {
    warn(client, "this viewer may only watch and stop the robot: open the address with the token");
    return false;
  }
  if (holder_) {
    warn(client, "another viewer holds control");
    return false;
  }
  holder_ = id;
  feed_.set_control(LiveFeed::Control::Held);
  return true;
}

void LiveHub::release(Id id, bool lost) {
  if (holder_ != id) return;
  holder_.reset();
  feed_.set_control(lost ? LiveFeed::Control::Lost : LiveFeed::Control::None);
}

void LiveHub::pass_order(Id id, Client& client, const ViewerOrder& order) {
  const bool only_stops = order.kind == ViewerOrder::Kind::Stop && (holder_ || !client.may_command);
  if (only_stops || take(id, client)) feed_.order(order);
}

void LiveHub::subscribe(Client& client, const ClientSubscribe& message) {
  for (const auto& [subscription, channel] : message.wanted) {
    if (channel >= channels_.known().size()) {
      warn(client, fmt::format("unknown channel {}", channel));
    } else if (client.channel_of.size() >= kMaxSubscriptions) {
      warn(client, "too many subscriptions");
    } else if (client.channel_of.emplace(subscription, channel).second) {
      const LiveMessage* last = channels_.latched(channel);
      if (last != nullptr)
        put(client, {.head = message_head(subscription, last->host_ns), .body = last->cdr});
    }
  }
}

void LiveHub::advertise_own(Client& client, const ClientAdvertise& message) {
  for (const auto& [channel, topic, encoding] : message.channels) {
    if (!client.may_command && topic != kOrderTopic)
      warn(client, "this viewer may only stop the robot: connect with ?token=… in the address");
    else if (encoding != "json" || (topic != kOrderTopic && topic != kDriveTopic))
      warn(client, fmt::format("only {} and {} are accepted, with encoding json", kOrderTopic, kDriveTopic));
    else if (client.publishes.size() < kMaxSubscriptions)
      client.publishes[channel] = topic;
  }
}

void LiveHub::receive_text(Id id, std::string_view text, Duration now) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  Client& client = found->second;
  const Result<ClientMessage> message = parse_client_text(text);
  if (!message) return warn(client, message.error().message);
  client.received = now;
  std::visit(
      [&](const auto& request) {
        using Kind = std::remove_cvref_t<decltype(request)>;
        if constexpr (std::is_same_v<Kind, ClientSubscribe>) {
          subscribe(client, request);
        } else if constexpr (std::is_same_v<Kind, ClientUnsubscribe>) {
          for (const std::uint32_t one : request.subscriptions) client.channel_of.erase(one);
        } else if constexpr (std::is_same_v<Kind, ClientAdvertise>) {
          advertise_own(client, request);
        } else if constexpr (std::is_same_v<Kind, ClientUnadvertise>) {
          for (const std::uint32_t one : request.channels) client.publishes.erase(one);
          if (client.publishes.empty() && !client.page) release(id, false);
        } else if constexpr (std::is_same_v<Kind, ClientTakes>) {
          static_cast<void>(take(id, client));
        } else if constexpr (std::is_same_v<Kind, ClientReleases>) {
          release(id, false);
        } else if constexpr (std::is_same_v<Kind, ClientOrders>) {
          pass_order(id, client, request.order);
        } else if constexpr (std::is_same_v<Kind, ClientUnsupported>) {
          warn(client, fmt::format("unknown operation '{}'", request.op));
        }
      },
      *message);
}

void LiveHub::receive_binary(Id id, std::span<const std::uint8_t> bytes, Duration now) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  Client& client = found->second;
  const Result<ClientPublishes> published = parse_client_binary(bytes);
  if (!published) return warn(client, published.error().message);
  const auto topic = client.publishes.find(published->channel);
  if (topic == client.publishes.end())
    return warn(client, fmt::format("channel {} was not advertised", published->channel));
  const std::string_view json(reinterpret_cast<const char*>(published->message.data()),
                              published->message.size());
  const Result<ViewerOrder> order = parse_published(topic->second, json);
  if (!order) return warn(client, order.error().message);
  client.received = now;
  pass_order(id, client, *order);
}

std::optional<OutFrame> LiveHub::next(Id id) {
  const auto found = clients_.find(id);
  return found == clients_.end() ? std::nullopt : found->second.outbox.next();
}

bool LiveHub::waits(Id id) const {
  const auto found = clients_.find(id);
  return found != clients_.end() && !found->second.outbox.empty();
}

bool LiveHub::lost(Id id) const {
  const auto found = clients_.find(id);
  return found == clients_.end() || found->second.lost;
}

}  // namespace waymark
