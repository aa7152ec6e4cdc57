import { describe, expect, it } from "vitest";
import { distanceToFit, type ViewAxes } from "./fit";
import type { Vec3 } from "./pose";

const tanHalf = Math.tan((25 * Math.PI) / 180);
const slope = Math.SQRT1_2;
const axes: ViewAxes = { right: [1, 0, 0], up: [0, slope, slope], forward: [0, slope, -slope] }; // 45 degrees from above

function seen(p: Vec3, target: Vec3, distance: number, aspect: number): boolean {
  const d = p.map((v, i) => v - (target[i]! - distance * axes.forward[i]!));
  const along = (axis: Vec3): number => d.reduce((sum, v, i) => sum + v * axis[i]!, 0);
  const depth = along(axes.forward), slack = 1e-9;
  return depth > 0 && Math.abs(along(axes.right)) <= depth * tanHalf * aspect + slack && Math.abs(along(axes.up)) <= depth * tanHalf + slack;
}

describe("distanceToFit", () => {
  const corners: Vec3[] = [[-4, -1, 0], [4, -1, 0], [4, 3, 0], [-4, 3, 0], [0, 3, 1.2]];
  for (const aspect of [0.46, 1, 1.6, 2.5]) {
    it(`contains every point in an image of aspect ${aspect}, and a nearer camera does not`, () => {
      const target: Vec3 = [0.5, 1, 0];
      const distance = distanceToFit(corners, target, axes, tanHalf, aspect);
      expect(corners.every((p) => seen(p, target, distance, aspect))).toBe(true);
      expect(corners.every((p) => seen(p, target, 0.99 * distance, aspect))).toBe(false);
    });
  }
});
