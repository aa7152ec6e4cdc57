#include "waymark/server/seats.hpp"

#include <algorithm>

namespace waymark {

std::optional<Seats::Id> Seats::oldest(Guest guest) const {
  const auto found = std::ranges::find_if(guests_, [&](const auto& one) { return one.second == guest; });
  return found == guests_.end() ? std::nullopt : std::optional(found->first);
}

std::size_t Seats::count(Guest guest) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(guests_, [&](const auto& one) { return one.second == guest; }));
}

std::optional<Seats::Admission> Seats::admit() {
  Admission admission{.id = next_};
  if (guests_.size() >= most_) {
    admission.dropped = oldest(Guest::Waiting);
    if (!admission.dropped) admission.dropped = oldest(Guest::Looks);
    if (!admission.dropped) return std::nullopt;
    leave(*admission.dropped);
  }
  guests_[next_++] = Guest::Waiting;
  return admission;
}

std::optional<Seats::Id> Seats::request_received(Id id, bool token) {
  const auto found = guests_.find(id);
  if (found == guests_.end()) return std::nullopt;
  found->second = token ? Guest::Owner : Guest::Looks;
  const std::size_t reserved = std::min(kReserved, most_ / 4);
  if (count(Guest::Looks) <= most_ - reserved) return std::nullopt;
  const std::optional<Id> dropped = oldest(Guest::Looks);
  leave(*dropped);
  return dropped;
}

std::size_t seats_for(std::uint64_t descriptors, std::uint64_t kept) {
  constexpr std::uint64_t kLeast = 4;
  const std::uint64_t fit = descriptors > kept ? (descriptors - kept) / 2 : 0;
  return static_cast<std::size_t>(std::clamp<std::uint64_t>(fit, kLeast, Seats::kMaxSeats));
}

}  // namespace waymark
