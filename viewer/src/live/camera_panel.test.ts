import { describe, expect, it } from "vitest";
import { factsOf, placeOf, rowOf, valueAt, type CameraControl } from "./camera_panel";

const exposure: CameraControl = { name: "exposure_ms", value: 10, min: 0.3, max: 204.7, step: 0.1, automatic: true, writable: true };
const gain: CameraControl = { name: "gain", value: 10, min: 0, max: 100, step: 1, automatic: false, writable: true };

describe("the panel of a camera", () => {
  it("converts values to slider positions and back, on the steps of the control", () => {
    for (const control of [exposure, gain]) {
      expect(placeOf(control, control.min)).toBeCloseTo(0);
      expect(placeOf(control, control.max)).toBeCloseTo(1);
      expect(valueAt(control, placeOf(control, control.value))).toBeCloseTo(control.value, 6);
    }
    expect(valueAt(exposure, 0.5)).toBeCloseTo(7.8, 6); // the geometric mean of the limits
    expect(valueAt(gain, 0.333)).toBe(33);
  });
  it("shows non-zero values only", () => {
    expect(factsOf({ camera: "HD Webcam", rate_hz: 29.97, age_ms: 21.4, dropped: 0, lost: 2, damaged: 0 }))
      .toBe("HD Webcam; 30.0 Hz; tags 21 ms after the exposure; 2 lost by the driver");
  });
  it("shows distance and standard deviations of a tag", () => {
    expect(rowOf({ tag: "tag36h11:3", pose: { cam_t_tag_m: [0, 3, 4], sigma_t_m: [0.001, 0.002, 0.01], ambiguity_ratio: 2 } }))
      .toEqual(["tag36h11:3", "5.000", "0.000, 3.000, 4.000", "1.0, 2.0, 10.0"]);
    expect(rowOf({ tag: "tag36h11:3" })).toEqual(["tag36h11:3", "", "", ""]);
  });
});
