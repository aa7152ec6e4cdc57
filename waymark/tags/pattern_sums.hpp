#pragma once

// The sums of least squares over the pixels of a tag, written once for every type of lanes (lane_math.hpp).
// No Eigen here.
#include <cstddef>

#include "waymark/tags/pattern_model.hpp"

namespace waymark::refinement {

/// The pixels of a tag.
struct PatternRows {
  int blocks = 0;
  bool clipped = false;  ///< whether any pixel is as dark or as bright as one can be
  std::size_t steps = 2;
  const PixelBlock* block = nullptr;
};

/// What is summed up over all pixels; of the information the upper triangle.
struct PatternSums {
  float information[kShared][kShared];
  float gradient[kShared];
  float cost, pixels;
};

/// What the clusters of one block say, by lanes.
struct BlockSums {
  float gradient[kShared + 1][kLanes];  ///< last: by kRim of the cluster's side
  float rim[kShared + 1][kLanes];       ///< information on kRim of the cluster's side, by all and itself
  float cost[kLanes], pixels[kLanes];   ///< without the weight of the cluster
};

/// Sums over the pixels; `blocks` gets one entry for each block. `with_information`: false leaves that out,
/// at a third of the time; BlockSums::rim too. O(pixels).
using SumPattern = PatternSums (*)(const PatternRows& rows, const PatternPoint& at, bool with_information,
                                   BlockSums* blocks);
[[nodiscard]] PatternSums sum_pattern_portable(const PatternRows& rows, const PatternPoint& at,
                                               bool with_information, BlockSums* blocks);
/// Where the program was built for x86-64; for processors with AVX2 and FMA.
[[nodiscard]] PatternSums sum_pattern_avx2(const PatternRows& rows, const PatternPoint& at,
                                           bool with_information, BlockSums* blocks);
/// The quickest of them that this processor can run.
[[nodiscard]] SumPattern quickest_sum_pattern();

namespace sums {

/// Sums over all pixels so far, by lanes.
template <class L>
struct LaneSums {
  L information[kShared][kShared];
  L cost = L::Zero(), pixels = L::Zero();
  LaneSums() {
    for (auto& row : information) {
      for (L& entry : row) entry = L::Zero();
    }
  }
};

/// Adds the derivatives of a block: all its rows for one entry after the other, so that the entry is fetched
/// once.
template <bool kRimMatters, class L>
[[gnu::always_inline]] inline void add_information(const L (*by)[kClusterPixels],
                                                   const L (&weight)[kClusterPixels], LaneSums<L>& sums,
                                                   BlockSums& block) {
  for (int i = 0; i < kShared; ++i) {
    L weighted[kClusterPixels];
    for (int r = 0; r < kClusterPixels; ++r) weighted[r] = weight[r] * by[i][r];
    for (int k = i; k < kShared; ++k) {
      L sum = sums.information[i][k];
      for (int r = 0; r < kClusterPixels; ++r) sum += weighted[r] * by[k][r];
      sums.information[i][k] = sum;
    }
  }
  if constexpr (kRimMatters) {
    for (int k = 0; k <= kShared; ++k) {
      L sum = L::Zero();
      for (int r = 0; r < kClusterPixels; ++r) sum += weight[r] * by[kShared][r] * by[k][r];
      store<L>(sum, block.rim[k]);
    }
  }
}

template <std::size_t kSteps, bool kRimMatters, bool kInformation, class L>
[[gnu::always_inline]] inline void add_block(const PixelBlock& of, bool clipped, const PatternPoint& at,
                                             LaneSums<L>& sums, BlockSums& block) {
  constexpr int kCount = kRimMatters ? kShared + 1 : kShared;
  L by[kShared + 1][kClusterPixels];
  L weight[kClusterPixels];
  L gradient[kShared + 1];
  for (L& entry : gradient) entry = L::Zero();
  const Rim<L> rim{load<L>(of.rim_u), load<L>(of.rim_v), load<L>(of.rim_1), load<L>(of.rim_level)};
  const L cluster_weight = load<L>(of.cluster_weight);
  L cost = L::Zero();
  L pixels = L::Zero();
  for (int r = 0; r < kClusterPixels; ++r) {
    RowModel<L> m;
    row_model<kSteps, kRimMatters, L>(of, clipped, static_cast<std::size_t>(r) * kLanes, at, rim, m);
    weight[r] = m.weight * cluster_weight;
    const L pull = weight[r] * m.residual;
    for (int i = 0; i < kCount; ++i) {
      gradient[i] += m.by[i] * pull;
      if constexpr (kInformation) by[i][r] = m.by[i];
    }
    const L square = m.residual * m.residual;
    cost += m.weight * square;
    pixels += m.weight;
    sums.cost += weight[r] * square;
    sums.pixels += weight[r];
  }
  store<L>(cost, block.cost);
  store<L>(pixels, block.pixels);
  for (int i = 0; i < kShared + 1; ++i) store<L>(gradient[i], block.gradient[i]);
  if constexpr (kInformation) add_information<kRimMatters, L>(by, weight, sums, block);
}

template <std::size_t kSteps, bool kInformation, class L>
void add_blocks(const PatternRows& rows, const PatternPoint& at, LaneSums<L>& sums, BlockSums* blocks) {
  for (int b = 0; b < rows.blocks; ++b) {
    const PixelBlock& of = rows.block[b];
    of.rim_matters ? add_block<kSteps, true, kInformation, L>(of, rows.clipped, at, sums, blocks[b])
                   : add_block<kSteps, false, kInformation, L>(of, rows.clipped, at, sums, blocks[b]);
  }
}

template <class L>
PatternSums sum_pattern(const PatternRows& rows, const PatternPoint& at, bool with_information,
                        BlockSums* blocks) {
  LaneSums<L> lanes;
  if (rows.steps <= 2) {
    with_information ? add_blocks<2, true, L>(rows, at, lanes, blocks)
                     : add_blocks<2, false, L>(rows, at, lanes, blocks);
  } else {
    with_information ? add_blocks<kMostSteps, true, L>(rows, at, lanes, blocks)
                     : add_blocks<kMostSteps, false, L>(rows, at, lanes, blocks);
  }
  PatternSums sums{};
  for (int i = 0; i < kShared; ++i) {
    for (int k = i; with_information && k < kShared; ++k)
      sums.information[i][k] = lanes.information[i][k].sum();
    L gradient = L::Zero();
    for (int b = 0; b < rows.blocks; ++b) gradient += load<L>(blocks[b].gradient[i]);
    sums.gradient[i] = gradient.sum();
  }
  sums.cost = lanes.cost.sum();
  sums.pixels = lanes.pixels.sum();
  return sums;
}

}  // namespace sums
}  // namespace waymark::refinement
