import { describe, expect, it, vi } from "vitest";
import { emptyTracks } from "../data/tracks";
import { CameraView, quadsAt, wordsOf } from "./camera_view";

const row = (t: number, id: number): number[] => [t, 0, id, 10, 10, 50, 10, 50, 50, 10, 50];

/** Two frames: tag 3 with usable corners and tag 5 with unreliable ones, then only tag 5. */
function tracksOf(): ReturnType<typeof emptyTracks> {
  const tracks = emptyTracks();
  tracks.tags.push(...row(1, 3));
  tracks.unreliable.push(...row(1, 5));
  tracks.tags.push(2, 0, -1, 0, 0, 0, 0, 0, 0, 0, 0);
  tracks.unreliable.push(...row(2, 5));
  tracks.tags.push(...row(3, 3));
  return tracks;
}

const namesAt = (t: number): [string, boolean][] => quadsAt(tracksOf(), ["tag36h11"], t).map(({ name, unreliable }) => [name, unreliable]);

describe("tags of a frame", () => {
  it("include the unreliable ones of the same image", () => {
    expect(namesAt(0.5)).toEqual([]);
    expect(namesAt(1.5)).toEqual([["tag36h11:3", false], ["tag36h11:5", true]]);
    expect(namesAt(2)).toEqual([["tag36h11:5", true]]);
    expect(namesAt(3)).toEqual([["tag36h11:3", false]]);
  });
  it("are listed below the image", () => {
    const quads = quadsAt(tracksOf(), ["tag36h11"], 1);
    expect(wordsOf(quads, true)).toBe("tag36h11:3, tag36h11:5 (dashed: unreliable corners, not used)");
    expect(wordsOf([], true)).toBe("no tag in view");
    expect(wordsOf([], false)).toBe("the recording has no detections");
  });
});

/** Records which dash is set at each stroke of a path. */
function contextThatRecords(): { context: object; dashes: number[] } {
  const dashes: number[] = [];
  let dash = 0;
  const context = new Proxy({ canvas: { width: 640 } } as Record<string, unknown>, {
    get: (target, key) =>
      key === "setLineDash" ? (segments: number[]) => { dash = segments.length; }
      : key === "stroke" ? () => dashes.push(dash)
      : key in target ? target[key as string] : () => undefined,
    set: () => true,
  });
  return { context, dashes };
}

describe("the image", () => {
  it("shows unreliable tags with a dashed outline and without axes", () => {
    vi.stubGlobal("ImageData", class {}); // Node has none
    const { context, dashes } = contextThatRecords();
    const canvas = { width: 640, height: 480, getContext: () => context } as unknown as HTMLCanvasElement;
    const words = { textContent: "" } as HTMLElement;
    new CameraView(canvas, words).draw(undefined, quadsAt(tracksOf(), ["tag36h11"], 1), new Map(), undefined, true);
    expect(dashes).toEqual([0, 0, 0, 2]); // the outline of tag 3 and its two axes, then the outline of tag 5
    expect(words.textContent).toContain("unreliable");
  });
});
