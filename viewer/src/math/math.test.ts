import { describe, expect, it } from "vitest";
import { project, projectTag, type Camera } from "./camera";
import { ellipseOf, nearestOnRoute, thinned } from "./plane";
import { compose, fromYaw, inverse, transform, wrapAngle, yawOf, type Pose } from "./pose";

const a_T_b: Pose = { p: [1, -2, 0.5], q: [0.1825742, 0.3651484, 0.5477226, 0.7302967] };

describe("poses", () => {
  it("are undone by their inverse", () => {
    const back = compose(inverse(a_T_b), a_T_b);
    back.p.forEach((v) => expect(v).toBeCloseTo(0, 6));
    expect(Math.abs(back.q[3])).toBeCloseTo(1, 6);
  });
  it("compose like their transformations", () => {
    const b_T_c = fromYaw(0.3, 0.7, 2.1);
    const once = transform(compose(a_T_b, b_T_c), [1, 2, 3]);
    const twice = transform(a_T_b, transform(b_T_c, [1, 2, 3]));
    once.forEach((v, i) => expect(v).toBeCloseTo(twice[i]!, 9));
  });
  it("keep the heading", () => {
    for (const yaw of [-3.1, -1, 0, 0.4, 3.1]) expect(yawOf(fromYaw(1, 2, yaw).q)).toBeCloseTo(yaw, 9);
  });
  it("wrap angles into (-π, π]", () => {
    expect(wrapAngle(3 * Math.PI)).toBeCloseTo(Math.PI, 9);
    expect(wrapAngle(-Math.PI)).toBe(Math.PI);
    expect(wrapAngle(7)).toBeCloseTo(7 - 2 * Math.PI, 9);
  });
});

describe("the plane", () => {
  it("finds the axes of a rotated ellipse", () => {
    const c = Math.cos(0.5), s = Math.sin(0.5); // sigmas 3 and 1, rotated by 0.5 rad
    const ellipse = ellipseOf(9 * c * c + s * s, 8 * c * s, 9 * s * s + c * c);
    expect(ellipse.major).toBeCloseTo(3, 9);
    expect(ellipse.minor).toBeCloseTo(1, 9);
    expect(ellipse.angle).toBeCloseTo(0.5, 9);
  });
  it("treats a rank-one covariance with negative rounding as a line", () => {
    expect(ellipseOf(1, 1 + 1e-12, 1).minor).toBe(0);
  });
  const square = [0, 0, 2, 0, 2, 2, 0, 2]; // counter-clockwise: the inside is to the left
  it("distinguishes left and right of a route", () => {
    expect(nearestOnRoute(square, true, 1, 0.25).crossTrack).toBeCloseTo(0.25, 12);
    expect(nearestOnRoute(square, true, 1, -0.25).crossTrack).toBeCloseTo(-0.25, 12);
  });
  it("uses the closing segment only if the route is closed", () => {
    expect(nearestOnRoute(square, true, 0.1, 1).yaw).toBeCloseTo(-Math.PI / 2, 12);
    expect(Math.abs(nearestOnRoute(square, false, 0.1, 1).crossTrack)).toBeGreaterThan(0.9);
  });
});

describe("the camera", () => {
  const camera: Camera = { width: 640, height: 480, fx: 400, fy: 410, cx: 320, cy: 240, skew: 0, model: "plumb_bob", distortion: [] };
  it("projects points ahead and none behind", () => {
    expect(project(camera, [0.5, -0.25, 2])).toEqual([420, 240 - 410 / 8]);
    expect(project(camera, [0, 0, -1])).toBeUndefined();
  });
  it("moves points outwards for a positive k1 (Brown's formula)", () => {
    const [u] = project({ ...camera, distortion: [0.1] }, [0.5, 0, 1])!;
    expect(u).toBeCloseTo(320 + 400 * 0.5 * (1 + 0.1 * 0.25), 9);
  });
  it("projects a tag ahead upright, corners TL TR BR BL", () => {
    const corners = projectTag(camera, fromYaw(0, 0, 0), { p: [0, 0, 2], q: [0, 0, 0, 1] }, 0.2)!;
    expect(corners).toEqual([[300, 219.5], [340, 219.5], [340, 260.5], [300, 260.5]]);
  });
});

describe("thinned polylines", () => {
  const polyline = (count: number, at: (i: number) => number[]): number[] => Array.from({ length: count }, (_, i) => at(i)).flat();
  /** The largest distance of a point from the kept segment around it. */
  const worst = (xyz: number[], kept: number[]): number => {
    let far = 0;
    for (let k = 0; k + 1 < kept.length; ++k) {
      const a = xyz.slice(3 * kept[k]!, 3 * kept[k]! + 3), b = xyz.slice(3 * kept[k + 1]!, 3 * kept[k + 1]! + 3);
      for (let i = kept[k]!; i <= kept[k + 1]!; ++i) {
        const p = xyz.slice(3 * i, 3 * i + 3), d = [0, 1, 2].map((c) => b[c]! - a[c]!);
        const length2 = d.reduce((sum, v) => sum + v * v, 0);
        const along = length2 === 0 ? 0 : Math.min(1, Math.max(0, d.reduce((sum, v, c) => sum + v * (p[c]! - a[c]!), 0) / length2));
        far = Math.max(far, Math.hypot(...p.map((v, c) => v - a[c]! - along * d[c]!)));
      }
    }
    return far;
  };
  const polylines: Record<string, number[]> = {
    circle: polyline(5000, (i) => [Math.cos(i * 0.004), Math.sin(i * 0.004), 0.1]),
    "there and back": polyline(400, (i) => [i < 200 ? i * 0.01 : (400 - i) * 0.01, 0, 0]),
    "stops, drives, stops": polyline(300, (i) => [Math.min(1, Math.max(0, i - 100) * 0.01), 0.3, 0]),
    ramp: polyline(300, (i) => [i * 0.01, 0, Math.max(0, i - 100) * 0.002]),
    noise: polyline(500, (i) => [i * 0.01 + 0.01 * Math.sin(i * 1.7), 0.02 * Math.sin(i * 12.3), 0]),
    jumps: polyline(20, (i) => [(i * 7) % 5, (i * 3) % 4, 0]),
  };
  for (const [name, xyz] of Object.entries(polylines)) {
    it(`stay within 2 mm of the removed points: ${name}`, () => {
      const kept = thinned(xyz, 0.002);
      expect(kept[0]).toBe(0);
      expect(kept.at(-1)).toBe(xyz.length / 3 - 1);
      kept.forEach((row, i) => i > 0 && expect(row).toBeGreaterThan(kept[i - 1]!));
      expect(worst(xyz, kept)).toBeLessThan(0.0045); // 2 mm, and the same when stationary or climbing
    });
  }
  it("need few points", () => {
    expect(thinned(polylines["circle"]!, 0.002).length).toBeLessThan(250);
    expect(thinned(polylines["there and back"]!, 0.002).length).toBeLessThan(6);
    expect(thinned([], 0.002)).toEqual([]);
    expect(thinned([1, 2, 3], 0.002)).toEqual([0]);
  });
});
