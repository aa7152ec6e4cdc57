import { describe, expect, it } from "vitest";
import { goWords, parseData, placeInSession, sessionPhases } from "./frames";

describe("frames of the live protocol", () => {
  it("parses opcode 1, subscription and time, little endian, then the message", () => {
    const bytes = Uint8Array.from([1, 7, 1, 0, 0, 0x15, 0xcd, 0x5b, 7, 0, 0, 0, 0, 42, 43]);
    expect(parseData(bytes.buffer)).toEqual({ subscription: 263, hostTime: 123456789n, data: Uint8Array.from([42, 43]) });
  });
  it("ignores other frames", () => {
    expect(parseData(new ArrayBuffer(12))).toBeUndefined();
    expect(parseData(Uint8Array.from([2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).buffer)).toBeUndefined();
  });
  it("every phase that the operator can leave has a button text, and a place in the session", () => {
    for (const phase of ["idle", "teaching", "ready", "replaying", "paused", "done", "stopped"]) {
      expect(goWords[phase]).toBeTruthy();
      expect(placeInSession(phase)).toBeGreaterThanOrEqual(0);
    }
    expect(placeInSession("paused")).toBe(sessionPhases.indexOf("replaying"));
    expect(placeInSession("over")).toBe(-1);
  });
});
