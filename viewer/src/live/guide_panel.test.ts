import { describe, expect, it } from "vitest";
import { cellOfTilt, guideFacts, rowsOf, type GuideStatus } from "./guide_panel";

const names = ["top left", "top", "top right", "left", "middle", "right", "bottom left", "bottom", "bottom right"];
const status: GuideStatus = {
  image: "hold still", views: 7, views_wanted: 12, held_out_rms_px: 0.214, focal_sigma_share: 0.00312, focal_sigma_share_wanted: 0.001,
  parts: names.map((part, i) => ({ part, corners: 5 * i, corners_wanted: 20, corners_in_image: i === 4 ? 12 : 0 })),
  tilts: [{ nearer_edge: "left", views: 1, views_wanted: 2 }, { nearer_edge: "right", views: 2, views_wanted: 2 }],
  missing: ["tilt the board"], good_enough: false,
};

describe("the panel of a guided calibration", () => {
  it("arranges the parts as in the image", () => {
    const rows = rowsOf(status.parts);
    expect(rows.map((row) => row.map(({ name }) => name))).toEqual([names.slice(0, 3), names.slice(3, 6), names.slice(6)]);
  });
  it("marks covered and missing parts, and the place of the board", () => {
    const cells = rowsOf(status.parts).flat();
    expect(cells.map(({ covered }) => covered)).toEqual([false, false, false, false, true, true, true, true, true]);
    expect(cells[3]!.words).toBe("15 of 20");
    expect(cells[4]!.words).toBe("✓ 20");
    expect(cells.filter(({ here }) => here).map(({ name }) => name)).toEqual(["middle"]);
  });
  it("names the near edge of a tilt", () => {
    expect(status.tilts.map(cellOfTilt)).toEqual([
      { name: "left edge nearer", words: "1 of 2", covered: false, here: false },
      { name: "right edge nearer", words: "✓ 2", covered: true, here: false },
    ]);
  });
  it("shows the progress and omits unknown values", () => {
    expect(guideFacts(status)).toBe("7 of 12 views; focal length ± 0.31 %, 0.1 % wanted; held-out error 0.21 px; hold still");
    const { held_out_rms_px, focal_sigma_share, ...begun } = status;
    expect([held_out_rms_px, focal_sigma_share]).toEqual([0.214, 0.00312]);
    expect(guideFacts({ ...begun, views: 1, image: "no board in view" })).toBe("1 of 12 views; no board in view");
    expect(guideFacts({ ...status, good_enough: true })).toContain("; good enough");
  });
});
