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
    visit(self.exposure_ms, Field{"exposure_ms", "Exposure time.", 0, 1000});
    visit(self.readout_ms,
          Field{"readout_ms", "Readout time of a rolling shutter, first row to last; 0: global shutter.", 0,
                1000});
    visit(self.blur_step_px,
          Field{"blur_step_px", "Maximum motion of a tag between two samples of the exposure.", 0.05, 10});
    visit(
        self.lens_sigma_px,
        Field{"lens_sigma_px",
              "Standard deviation of the blur of the lens, on top of the integration over the pixel.", 0, 5});
    visit(self.aperture_mm,
          Field{"aperture_mm", "Diameter of the entrance pupil; 0: pinhole, no defocus.", 0, 100});
    visit(self.focus_distance_m, Field{"focus_distance_m", "Distance of sharp focus.", 0.01, 1e6});
    visit(self.vignetting_power,
          Field{"vignetting_power",
                "Vignetting: exponent of the cosine of the angle from the axis; 4 is natural.", 0, 20});
    visit(self.white_level_dn,
          Field{"white_level_dn", "Grey level of white paper in nominal light, before gamma.", 1, 1000});
    visit(self.full_well_electrons,
          Field{"full_well_electrons",
                "Electrons at grey level 255, which set the shot noise; 0: no shot noise.", 0, 1e9});
    visit(self.read_noise_electrons,
          Field{"read_noise_electrons", "Standard deviation of the read noise, in electrons.", 0, 1e6});
    visit(self.gamma,
          Field{"gamma",
                "Gamma of the picture: output is input to the power of 1 / gamma; 2.2 is usual for displays.",
                0.2, 5});
    visit(self.ambient,
          Field{"ambient", "Share of ambient light; the rest comes from the lamp (Lambertian).", 0, 1});
    visit(self.flicker,
          Field{"flicker", "Relative amplitude of the flicker of lamps at mains frequency.", 0, 1});
    visit(self.flicker_hz,
          Field{"flicker_hz", "Frequency of the flicker: twice that of the mains.", 1, 100000});
    visit(self.drift, Field{"drift", "Relative amplitude of the illumination drift.", 0, 1});
    visit(self.drift_period_s, Field{"drift_period_s", "Period of the illumination drift.", 0.01, 1e6});
    visit(self.jpeg_quality,
          Field{"jpeg_quality", "JPEG quality with which the driver encodes a picture; 0: not encoded.", 0,
                100});
  }
};

}  // namespace waymark
