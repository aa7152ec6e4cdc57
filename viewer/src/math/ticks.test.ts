import { describe, expect, it } from "vitest";
import { labelsOf, ticksOf } from "./ticks";

describe("ticksOf", () => {
  it("gives three to seven ticks within any axis", () => {
    let seed = 7;
    const random = (): number => (seed = (seed * 16807) % 2147483647) / 2147483647;
    for (let i = 0; i < 2000; ++i) {
      const low = (random() - 0.5) * 10 ** Math.floor(random() * 6 - 2), high = low + (0.01 + random()) * 10 ** Math.floor(random() * 6 - 2);
      const ticks = ticksOf(low, high);
      expect(ticks.length, `${low} to ${high}`).toBeGreaterThanOrEqual(3);
      expect(ticks.length, `${low} to ${high}`).toBeLessThanOrEqual(7);
      expect(Math.min(...ticks)).toBeGreaterThanOrEqual(low - 1e-6 * (high - low));
      expect(Math.max(...ticks)).toBeLessThanOrEqual(high + 1e-6 * (high - low));
    }
  });
  it("labels them with equal numbers of decimals", () => {
    expect(labelsOf(ticksOf(-0.3, 0.35))).toEqual(["-0.2", "0.0", "0.2"]);
    expect(labelsOf(ticksOf(0, 10))).toEqual(["0", "5", "10"]);
  });
  it("gives none for an empty axis", () => expect(ticksOf(1, 1)).toEqual([]));
});
