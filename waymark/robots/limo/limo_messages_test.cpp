// Tests decoding and encoding LIMO's frames, and finding them among damaged bytes.
#include "waymark/robots/limo/limo_messages.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const LimoFrame& frame) {
  const auto encoded = encode(frame);
  return {encoded.begin(), encoded.end()};
}

std::vector<LimoFrame> frames_in(const Bytes& bytes, std::size_t piece = 1000) {
  LimoReader reader;
  std::vector<LimoFrame> frames;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    reader.add(std::span(bytes).subspan(at, std::min(piece, bytes.size() - at)));
    while (const auto frame = reader.next()) frames.push_back(*frame);
  }
  return frames;
}

TEST(LimoFrame, HasTheBytesOfLimosOwnDriver) {
  // limo_driver.cpp from AgileX, setMotionCommand(0.3, -0.5, 0, 0) and sendFrame(), evaluated by hand.
  EXPECT_THAT(encode(encode_command({0.3, -0.5}, LimoDrive::Differential)),
              ElementsAre(0x55, 0x0E, 0x01, 0x11, 0x01, 0x2C, 0xFE, 0x0C, 0, 0, 0, 0, 0, 0x37));
  EXPECT_THAT(encode(take_command(LimoDrive::Ackermann)),
              ElementsAre(0x55, 0x0E, 0x04, 0x21, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0x01));
  EXPECT_EQ(take_command(LimoDrive::Mecanum).data[2], 1) << "enableMcMode()";
}

TEST(LimoReader, FindsFramesInPiecesOfAnySize) {
  Bytes wire;
  std::vector<LimoFrame> sent;
  for (std::uint8_t k = 0; k < 20; ++k) {
    sent.push_back(encode_motion_feedback({.speed_m_s = 0.05 * k, .yaw_rate_rad_s = -0.1 * k}));
    sent.back().count = k;
    for (const std::uint8_t byte : bytes_of(sent.back())) wire.push_back(byte);
  }
  for (std::size_t piece = 1; piece < 40; ++piece) EXPECT_EQ(frames_in(wire, piece), sent) << piece;
}

TEST(LimoReader, FindsAFrameThatBeginsInsideADamagedOne) {
  const LimoFrame whole = encode_attitude({1, 0.2, 0});
  const Bytes good = bytes_of(whole);
  for (std::size_t torn = 1; torn < kLimoFrameBytes; ++torn) {
    Bytes wire = bytes_of(encode_acceleration({1, -2, 9.81}));
    wire.resize(torn);
    wire.insert(wire.end(), good.begin(), good.end());
    EXPECT_THAT(frames_in(wire), ElementsAre(whole)) << torn << " bytes of the previous frame";
  }
  Bytes doubled = good;
  doubled.insert(doubled.begin(), 0x55);
  EXPECT_THAT(frames_in(doubled), ElementsAre(whole)) << "the first byte of the header, repeated";
}

TEST(LimoReader, FindsMostFramesInNoiseAndFewFalseOnes) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_real_distribution<double> chance(0, 1);
  Bytes wire;
  std::vector<LimoFrame> sent;
  int damaged = 0;
  for (int k = 0; k < 20000; ++k) {
    sent.push_back(encode_odometer({.left_m = 1e-3 * k, .right_m = 2e-3 * k}));
    bool is_damaged = false;
    for (const std::uint8_t value : bytes_of(sent.back())) {
      const double fate = chance(random);
      if (fate >= 0.001) wire.push_back(value);  // otherwise the byte is lost
      if (fate >= 0.001 && fate < 0.002) wire.push_back(value);
      if (fate > 0.999) wire.back() = static_cast<std::uint8_t>(byte(random));
      if (fate > 0.998 && fate < 0.999) wire.push_back(static_cast<std::uint8_t>(byte(random)));
      is_damaged = is_damaged || fate < 0.002 || fate > 0.998;
    }
    damaged += is_damaged ? 1 : 0;
  }
  const std::vector<LimoFrame> found = frames_in(wire, 37);
  std::size_t false_frames = 0;
  std::size_t at = 0;
  for (const LimoFrame& frame : found) {
    const auto same = std::find(sent.begin() + static_cast<std::ptrdiff_t>(at), sent.end(), frame);
    if (same == sent.end())
      ++false_frames;
    else
      at = static_cast<std::size_t>(same - sent.begin()) + 1;
  }
  EXPECT_GT(damaged, 800);
  // Some damage is harmless (a byte between two frames, a repeated first byte), so at most the damaged frames
  // are lost.
  EXPECT_GE(found.size() - false_frames, sent.size() - static_cast<std::size_t>(damaged));
  EXPECT_LT(false_frames, static_cast<std::size_t>(damaged) / 20) << "of " << damaged;
}

TEST(LimoMessages, RoundTripWithinTheResolution) {
  const auto motion = decode_motion(encode_motion_feedback({0.3214, -1.2344, 0.111, 0.2}));
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->speed_m_s, 0.3214, 5e-4);
  EXPECT_NEAR(motion->yaw_rate_rad_s, -1.2344, 5e-4);
  EXPECT_NEAR(motion->lateral_m_s, 0.111, 5e-4);
  EXPECT_NEAR(motion->steering_rad, 0.2, kLimoSteeringScale * 5e-4);
  const LimoOdometer odometer = decode_odometer(encode_odometer({-12.345, 2000.001}));
  EXPECT_NEAR(odometer.left_m, -12.345, 5e-4);
  EXPECT_NEAR(odometer.right_m, 2000.001, 5e-4);
  const auto state = decode_state(
      encode_state({LimoState::Vehicle::EmergencyStop, true, 11.94, 0x0142, LimoDrive::Mecanum}));
  ASSERT_TRUE(state);
  EXPECT_EQ(state->vehicle, LimoState::Vehicle::EmergencyStop);
  EXPECT_TRUE(state->commanded);
  EXPECT_NEAR(state->battery_V, 11.9, 1e-9);
  EXPECT_EQ(state->drive, LimoDrive::Mecanum);
  EXPECT_EQ(state->errors, 0x0142);
  EXPECT_EQ(limo_error_texts(state->errors).size(), 3U);
  for (const std::string& text : limo_error_texts(0xffff)) testing::expect_on_page("robots", text);
  const Eigen::Vector3d attitude = decode_attitude_rad(encode_attitude({-3.1, 0.01, 0.02}));
  EXPECT_NEAR((attitude - Eigen::Vector3d(-3.1, 0.01, 0.02)).norm(), 0, 2e-4);
}

TEST(LimoMessages, RejectsImplausibleValues) {
  EXPECT_FALSE(decode_motion(encode_motion_feedback({.speed_m_s = 9})));
  EXPECT_FALSE(decode_motion(encode_motion_feedback({.yaw_rate_rad_s = -20})));
  LimoFrame state = encode_state({});
  state.data[6] = 9;
  EXPECT_FALSE(decode_state(state));
}

TEST(LimoCommand, AckermannSteersForTheCurvatureUpToItsMaximum) {
  for (const double radius_m : {0.5, 0.8, 2.0, -0.6, -3.0}) {
    for (const double speed_m_s : {0.3, -0.3}) {
      const VelocityCommand asked{speed_m_s, speed_m_s / radius_m};
      const VelocityCommand sent =
          decode_command(encode_command(asked, LimoDrive::Ackermann), LimoDrive::Ackermann);
      EXPECT_NEAR(sent.speed_m_s, asked.speed_m_s, 1e-9);
      EXPECT_NEAR(sent.yaw_rate_rad_s, asked.yaw_rate_rad_s, 0.005) << radius_m << " " << speed_m_s;
    }
  }
  const auto tightest = [](const VelocityCommand& asked) {
    return decode_motion(encode_command(asked, LimoDrive::Ackermann))->steering_rad;
  };
  EXPECT_NEAR(tightest({0.3, 3}), kLimoMaxSteering_rad, 2e-3);
  EXPECT_NEAR(tightest({0, -1}), -kLimoMaxSteering_rad, 2e-3) << "it steers without moving";
  EXPECT_EQ(encode_command({0, -1}, LimoDrive::Ackermann).data[0], 0);
  EXPECT_EQ(tightest({0, 0}), 0);
}

TEST(LimoCommand, LimitsTheSpeedAndReplacesNonFiniteCommandsByZero) {
  const auto sent = [](const VelocityCommand& asked) {
    return decode_command(encode_command(asked, LimoDrive::Tracked), LimoDrive::Tracked);
  };
  EXPECT_EQ(sent({7, 0}).speed_m_s, kLimoTopSpeed_m_s);
  EXPECT_EQ(sent({-7, 0}).speed_m_s, -kLimoTopSpeed_m_s);
  EXPECT_EQ(sent({0.3, std::nan("")}), VelocityCommand{});
  EXPECT_NEAR(sent({0, 1e9}).yaw_rate_rad_s, 32.767, 1e-9);
}

}  // namespace
}  // namespace waymark
