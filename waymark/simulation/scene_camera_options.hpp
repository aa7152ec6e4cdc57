#pragma once

#include "waymark/base/fields.hpp"

namespace waymark {

/// Every knob of a camera that sees a scene. docs/concepts/camera_simulation.md shows each of them.
struct SceneCameraOptions {
  double exposure_ms = 10;
  double readout_ms = 0;
  double blur_step_px = 0.5;
  double lens_sigma_px = 0.5;
  double aperture_mm = 0;
  double focus_distance_m = 2;
  double vignetting_power = 0;
  double white_level_dn = 190;
  double full_well_electrons = 12000;
  double read_noise_electrons = 12;
  double gamma = 1;
  double ambient = 0.75;
  double flicker = 0;
  double flicker_hz = 100;
  double drift = 0;
  double drift_period_s = 20;
  int jpeg_quality = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.exposure_ms, Field{"exposure_ms", "How long the shutter is open.", 0, 1000});
    visit(
        self.readout_ms,
        Field{"readout_ms",
              "From the first row's exposure to the last one's (rolling shutter); 0: all at once.", 0, 1000});
    visit(self.blur_step_px,
          Field{"blur_step_px", "Longest way a tag goes between two moments the exposure is summed over.",
                0.05, 10});
    visit(self.lens_sigma_px,
          Field{"lens_sigma_px",
                "Standard deviation of the lens's spread, on top of the square of the pixel.", 0, 5});
    visit(self.aperture_mm, Field{"aperture_mm", "Diameter of the entrance pupil; 0: all is sharp.", 0, 100});
    visit(self.focus_distance_m, Field{"focus_distance_m", "Where it is sharp.", 0.01, 1e6});
    visit(self.vignetting_power,
          Field{"vignetting_power",
                "Light falls off as this power of the cosine from the axis; 4 is natural.", 0, 20});
    visit(self.white_level_dn,
          Field{"white_level_dn", "Grey level of white paper in nominal light, before gamma.", 1, 1000});
    visit(
        self.full_well_electrons,
        Field{"full_well_electrons", "Electrons at 255, which shot noise counts; 0: no shot noise.", 0, 1e9});
    visit(self.read_noise_electrons,
          Field{"read_noise_electrons", "Standard deviation of the noise in the dark, of a full well.", 0,
                1e6});
    visit(self.gamma,
          Field{"gamma", "Output is input to the power of 1 over this; 2.2 as most displays.", 0.2, 5});
    visit(self.ambient,
          Field{"ambient", "Share of the light that comes from everywhere; the rest is the lamp's (Lambert).",
                0, 1});
    visit(self.flicker, Field{"flicker", "Swing of the light of lamps at mains frequency, relative.", 0, 1});
    visit(self.flicker_hz, Field{"flicker_hz", "Twice the frequency of the mains.", 1, 100000});
    visit(self.drift, Field{"drift", "Swing of the light as clouds pass, relative.", 0, 1});
    visit(self.drift_period_s, Field{"drift_period_s", "Of the clouds.", 0.01, 1e6});
    visit(self.jpeg_quality,
          Field{"jpeg_quality",
                "Quality of the JPEG the picture goes through; 0: none. Applied by the driver.", 0, 100});
  }
};

}  // namespace waymark
