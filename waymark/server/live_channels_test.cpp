#include "waymark/server/live_channels.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

/// Topics of the messages for a frame, if all channels known before it are wanted.
std::vector<std::string> topics_of(LiveChannels& channels, const TagFrame& frame) {
  std::set<std::uint32_t> wanted;
  for (const LiveChannel& channel : channels.known()) wanted.insert(channel.id);
  std::vector<std::string> topics;
  for (const LiveMessage& message : channels.encode({Sample(frame), 1}, wanted))
    topics.push_back(channels.known().at(message.channel).topic);
  return topics;
}

TEST(LiveChannels, UnreliableTagsHaveTheirOwnChannelAndPrecedeTheOthers) {
  LiveChannels channels;
  TagFrame frame{.camera = "left", .detections = {{}, {}}};
  EXPECT_EQ(topics_of(channels, frame), std::vector<std::string>());
  EXPECT_EQ(channels.known().size(), 2U) << "both channels are known from the first frame on";
  EXPECT_EQ(topics_of(channels, frame), std::vector<std::string>{"/left/tag_detections"});
  frame.detections[1].corner_state = CornerState::Unreliable;
  frame.detections[1].tag.number = 7;
  EXPECT_EQ(topics_of(channels, frame),
            (std::vector<std::string>{"/left/unreliable_tags", "/left/tag_detections"}));

  const std::vector<LiveMessage> messages = channels.encode({Sample(frame), 1}, {0, 1});
  ASSERT_EQ(messages.size(), 2U);
  const auto unreliable = cdr::decode<ros2::UnreliableTags>(*messages[0].cdr);
  ASSERT_TRUE(unreliable);
  ASSERT_EQ(unreliable->detections.size(), 1U);
  EXPECT_EQ(unreliable->detections[0].id, 7);
}

}  // namespace
}  // namespace waymark
