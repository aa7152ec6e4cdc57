import type { Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import type { TrackName } from "../data/tracks";
import type { Control, RobotState } from "./frames";

/** Messages of the page to its link: a message for the server, or a request for the next updates. */
export type ToLink = { readonly send: object } | { readonly next: true };

export interface LiveImage {
  readonly t: number;
  readonly bytes: Uint8Array<ArrayBuffer>; // JPEG or PNG
}
export interface ShownImage {
  readonly t: number;
  readonly hostTime: bigint; // [ns] of the server's clock, when the robot's program received it
  readonly bitmap: ImageBitmap;
}

/** Everything since the last updates: a slow page receives them late, but never outdated ones. */
export interface Updates {
  readonly rows: Partial<Record<TrackName, Float64Array>>;
  readonly families: readonly string[];
  readonly name?: string; // name of the robot; set when connected
  readonly lost?: boolean;
  readonly camera?: Camera;
  readonly base_T_cam?: Pose;
  readonly states: readonly RobotState[]; // the newest of each phase
  readonly control?: Control;
  readonly texts: readonly { readonly name: string; readonly text: string }[];
  readonly words: readonly string[];
  readonly images: readonly LiveImage[]; // kept to look back
  readonly shown?: ShownImage; // the newest image with known tags
}
