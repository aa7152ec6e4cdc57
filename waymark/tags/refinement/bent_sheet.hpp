#pragma once

#include <array>
#include <optional>

#include "waymark/image/image.hpp"
#include "waymark/tags/refinement/curved_border.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

namespace waymark::refinement {

/// Two explanations of a border that is not that of a flat tag, compared by the steps between the cells
/// inside: the sheet is bent as its border is, or the sheet is flat and a part of its border is covered. The
/// offsets of steps from their expected places are in cells. Large offsets are limited, and steps that are
/// not visible count as large ones.
struct SheetComparison {
  double if_bent = 0;  ///< mean squared offset
  double if_flat = 0;
  double border_if_flat = 0;  ///< of the border on the second best of its sides: a plane with one covered
                              ///< side explains three sides, and one with two covered sides explains two
  std::array<double, 4> bent_by_quarter{};  ///< the same for each quarter of the tag
  std::array<double, 4> flat_by_quarter{};
  std::array<double, 4> in_place{};  ///< share of the steps in the outer rows of bits along each side that
                                     ///< are where the bent sheet places them
  double white_growth_px = 0;        ///< of white cells into black ones, by a bent sheet's steps: gamma, ink
  double white_growth_sigma_px = 0;  ///< standard deviation
  int steps = 0;
  double cell_px = 0;

  /// Whether the bits confirm that this is the border of the tag and that it is curved.
  [[nodiscard]] bool confirms_bend() const;
  /// Whether the bits agree with the bent sheet about as well as with the flat one. They must agree better if
  /// the border is straight, as it is on a bottle seen from the front.
  [[nodiscard]] bool allows_bend(const CurvedBorder& border) const;

 private:
  [[nodiscard]] bool bits_are_in_place() const;
  [[nodiscard]] bool bits_prefer_bend() const;
  [[nodiscard]] bool border_excludes_plane() const;
};

/// Each sheet is fitted to the steps, which are measured again where the fit places them. The bent one has
/// the corners of `border` and bends between its sides (a Coons patch), with little freedom inside. The flat
/// one is free; its fit starts both at those corners and at `near_px`. O(cells); does not allocate.
[[nodiscard]] SheetComparison compare_sheets(const ImageView& image, const PrintedTag& print,
                                             const CurvedBorder& border, const Quad& near_px);

/// The border of a tag whose sheet is bent, or may be.
struct Bend {
  CurvedBorder border;     ///< corrected by the growth of white cells
  bool confirmed = false;  ///< by the bits inside; otherwise these only allow it
  double if_bent = 0;      ///< [cell^2] mean squared offset of the bits
};

/// Follows the border from a quad near it and compares both sheets. Returns `nullopt` if the bits exclude a
/// bend, the cells are too small, the border cannot be followed, or no side bulges by
/// `least_bulge_px`. O(length of the border + cells); does not allocate.
[[nodiscard]] std::optional<Bend> find_bend(const ImageView& image, const PrintedTag& print,
                                            const Quad& near_px, double least_bulge_px = 0);

}  // namespace waymark::refinement
