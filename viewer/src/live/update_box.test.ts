import { describe, expect, it } from "vitest";
import type { RobotState } from "./frames";
import { UpdateBox } from "./update_box";

const tagsAt = (box: UpdateBox, t: number): void => {
  box.tracks.tags.push(t, 0, -1, 0, 0, 0, 0, 0, 0, 0, 0);
  box.grown();
};
const image = (box: UpdateBox, t: number): void => box.image(t, BigInt(Math.round(t * 1e9)), Uint8Array.of(t));
const state = (phase: string, driven_m: number): RobotState => ({
  phase, reason: "", commands: [], page_drives: false, halted: "", driven_m, goal_m: 0, dropped_images: 0, dropped_samples: 0, lights: [],
});

describe("updates of a running robot", () => {
  it("show an image once its tags are known", () => {
    const box = new UpdateBox();
    image(box, 1);
    expect(box.takeImage()).toBeUndefined();
    image(box, 2); // the detector is one image behind
    tagsAt(box, 1);
    expect(box.takeImage()?.t).toBe(1);
    expect(box.takeImage()).toBeUndefined();
    tagsAt(box, 2);
    expect(box.takeImage()?.t).toBe(2);
  });
  it("show an image that arrives after its tags at once", () => {
    const box = new UpdateBox();
    tagsAt(box, 3);
    image(box, 3);
    expect(box.takeImage()?.t).toBe(3);
  });
  it("are current, even after the page was busy", () => {
    const box = new UpdateBox();
    for (let t = 0; t < 1000; ++t) { image(box, t); tagsAt(box, t); box.state(state("teaching", t)); }
    expect(box.takeImage()?.t).toBe(999);
    const updates = box.take();
    expect(updates.images.length).toBe(300);
    expect(updates.images.at(-1)?.t).toBe(999);
    expect(updates.rows.tags?.length).toBe(11 * 1000);
    expect(updates.states).toEqual([state("teaching", 999)]);
  });
  it("do not wait for tags of lost images", () => {
    const box = new UpdateBox();
    for (let t = 0; t < 1000; ++t) image(box, t);
    tagsAt(box, 500); // discarded by now
    expect(box.takeImage()).toBeUndefined();
    tagsAt(box, 990);
    expect(box.takeImage()?.t).toBe(990);
  });
  it("contain each phase in order, with its newest state", () => {
    const box = new UpdateBox();
    for (const [phase, at] of [["idle", 0], ["teaching", 0], ["teaching", 2], ["mapping", 2]] as const) box.state(state(phase, at));
    expect(box.take().states.map((s) => [s.phase, s.driven_m])).toEqual([["idle", 0], ["teaching", 2], ["mapping", 2]]);
  });
  it("are returned once", () => {
    const box = new UpdateBox();
    box.opened("limo");
    box.text("map.yaml", "old");
    box.text("map.yaml", "new");
    for (let i = 0; i < 100; ++i) box.warn("no");
    tagsAt(box, 1);
    expect(box.full).toBe(true);
    const updates = box.take();
    expect([updates.name, updates.lost, updates.texts, updates.words.length]).toEqual(["limo", false, [{ name: "map.yaml", text: "new" }], 20]);
    expect(box.full).toBe(false);
    const then = box.take();
    expect([then.name, then.lost, then.texts, then.words, then.states, then.rows]).toEqual([undefined, undefined, [], [], [], {}]);
    tagsAt(box, 2);
    expect(box.take().rows.tags?.[0]).toBe(2); // only new rows
    box.lost();
    expect(box.take().lost).toBe(true);
  });
});
