#include "waymark/server/outbox.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

OutFrame data(std::size_t size, std::optional<std::uint32_t> newest_of = {}) {
  return {.head = "h", .body = std::make_shared<const Bytes>(size), .newest_of = newest_of};
}

TEST(Outbox, TheOldestGoesAndIsCounted) {
  Outbox box;
  for (std::size_t i = 0; i < Outbox::kMostFrames + 10; ++i) EXPECT_TRUE(box.put(data(i)));
  EXPECT_EQ(box.dropped(), 10u);
  EXPECT_EQ(box.next()->body->size(), 10u);
}

TEST(Outbox, BytesAreBounded) {
  Outbox box;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(box.put(data(1 << 20)));
    EXPECT_LE(box.bytes(), Outbox::kMostBytes);
  }
  while (box.next()) {
  }
  EXPECT_EQ(box.bytes(), 0u);
  EXPECT_TRUE(box.put(data(Outbox::kMostBytes + 1)));  // alone too much: it is dropped itself
  EXPECT_TRUE(box.empty());
}

TEST(Outbox, OfPicturesTheNewest) {
  Outbox box;
  EXPECT_TRUE(box.put(data(1, 5)));
  EXPECT_TRUE(box.put(data(2)));
  EXPECT_TRUE(box.put(data(3, 5)));
  EXPECT_EQ(box.next()->body->size(), 2u);
  EXPECT_EQ(box.next()->body->size(), 3u);
  EXPECT_TRUE(box.empty());
  EXPECT_EQ(box.dropped(), 1u);
}

TEST(Outbox, WhatMustArriveStaysUntilTheViewerIsGivenUp) {
  Outbox box;
  const OutFrame word{.text = true, .head = "word", .must_arrive = true};
  for (std::size_t i = 0; i < Outbox::kMostFrames; ++i) EXPECT_TRUE(box.put(word));
  EXPECT_TRUE(box.put(data(1)));  // dropped at once
  EXPECT_EQ(box.dropped(), 1u);
  EXPECT_FALSE(box.put(word));
}

}  // namespace
}  // namespace waymark
