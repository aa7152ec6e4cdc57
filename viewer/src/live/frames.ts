// Frames of the Foxglove WebSocket protocol that the page needs, and Waymark's additions (docs/formats/live.md).

export interface Channel {
  readonly id: number;
  readonly topic: string;
  readonly encoding: string;
  readonly schemaName: string;
  readonly schema: string;
}
export interface Light {
  readonly name: string;
  readonly level: "unknown" | "good" | "uncertain" | "bad";
  readonly message: string;
}
export interface RobotState {
  readonly phase: string;
  readonly reason: string;
  readonly commands: readonly string[];
  readonly page_drives: boolean;
  readonly halted: string;
  readonly driven_m: number;
  readonly goal_m: number;
  readonly dropped_images: number;
  readonly dropped_samples: number;
  readonly lights: readonly Light[];
}
export interface Control {
  readonly may: boolean;
  readonly yours: boolean;
  readonly held: boolean;
  readonly viewers: number;
  readonly dropped: number;
}

export type ServerText =
  | { readonly op: "serverInfo"; readonly name: string }
  | { readonly op: "advertise"; readonly channels: readonly Channel[] }
  | { readonly op: "status"; readonly message: string }
  | { readonly op: "text"; readonly name: string; readonly text: string }
  | ({ readonly op: "control" } & Control);

export interface DataFrame {
  readonly subscription: number;
  readonly hostTime: bigint; // [ns] of the server's clock
  readonly data: Uint8Array;
}

/** Parses opcode 1, subscription, time, message; undefined for any other frame. */
export function parseData(buffer: ArrayBuffer): DataFrame | undefined {
  if (buffer.byteLength < 13) return undefined;
  const view = new DataView(buffer);
  if (view.getUint8(0) !== 1) return undefined;
  return { subscription: view.getUint32(1, true), hostTime: view.getBigUint64(5, true), data: new Uint8Array(buffer, 13) };
}

/** Action of the session button in each phase. */
export const goWords: Readonly<Record<string, string>> = {
  idle: "Teach a lap", teaching: "Finish the lap", ready: "Replay", replaying: "Pause", paused: "Resume", done: "Replay again",
  stopped: "Replay again",
};
/** Phases in the order of the page; "paused" and "stopped" take the places of "replaying" and "done". */
export const sessionPhases = ["idle", "teaching", "mapping", "ready", "replaying", "done"] as const;
export const placeInSession = (phase: string): number =>
  sessionPhases.indexOf((phase === "paused" ? "replaying" : phase === "stopped" ? "done" : phase) as (typeof sessionPhases)[number]);
