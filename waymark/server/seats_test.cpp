#include "waymark/server/seats.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(Seats, DropsUnfinishedRequestsFirstOldestFirst) {
  Seats seats(8);
  const Seats::Id looks = seats.admit()->id;
  EXPECT_FALSE(seats.request_received(looks, false));
  const Seats::Id oldest = seats.admit()->id;
  for (int i = 0; i < 6; ++i) EXPECT_FALSE(seats.admit()->dropped);
  EXPECT_EQ(seats.taken(), 8U);
  const auto newcomer = seats.admit();
  ASSERT_TRUE(newcomer);
  EXPECT_EQ(newcomer->dropped, oldest);
  EXPECT_EQ(seats.taken(), 8U);
}

TEST(Seats, AFloodWithoutTheTokenNeverDropsAnOwner) {
  Seats seats(8);
  const Seats::Id owner = seats.admit()->id;
  EXPECT_FALSE(seats.request_received(owner, true));
  for (int i = 0; i < 1000; ++i) {
    const auto one = seats.admit();
    ASSERT_TRUE(one);
    EXPECT_NE(one->dropped, owner);
    if (i % 2 == 0) EXPECT_NE(seats.request_received(one->id, false), owner);
    EXPECT_LE(seats.taken(), 8U);
  }
  const auto second = seats.admit();
  ASSERT_TRUE(second) << "another owner is still admitted";
  EXPECT_FALSE(seats.request_received(second->id, true));
}

TEST(Seats, ConnectionsWithoutTheTokenLeaveSeatsFree) {
  Seats seats(8);
  Seats::Id first = 0;
  std::optional<Seats::Id> dropped;
  for (int i = 0; i < 7; ++i) {
    const Seats::Id id = seats.admit()->id;
    if (i == 0) first = id;
    dropped = seats.request_received(id, false);
  }
  EXPECT_EQ(dropped, first);
  EXPECT_EQ(seats.taken(), 6U);
}

TEST(Seats, RejectsAConnectionOnlyIfAllAreOwners) {
  Seats seats(4);
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(seats.request_received(seats.admit()->id, true));
  EXPECT_FALSE(seats.admit());
  seats.leave(1);
  EXPECT_TRUE(seats.admit());
}

TEST(Seats, ReservesDescriptorsForTheRecording) {
  EXPECT_EQ(seats_for(1024, 64), Seats::kMaxSeats);
  EXPECT_EQ(seats_for(128, 64), 32U);
  EXPECT_EQ(seats_for(64, 64), 4U);
  EXPECT_EQ(seats_for(UINT64_MAX, 64), Seats::kMaxSeats);
}

}  // namespace
}  // namespace waymark
