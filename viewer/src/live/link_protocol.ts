import type { Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import type { TrackName } from "../data/tracks";
import type { Control, RobotState } from "./frames";

/** What the page tells its link: a message for the server, or that it is ready for the next updates. */
export type ToLink = { readonly say: object } | { readonly next: true };

export interface LivePicture {
  readonly t: number;
  readonly bytes: Uint8Array<ArrayBuffer>; // JPEG or PNG
}
export interface ShownPicture {
  readonly t: number;
  readonly hostTime: bigint; // [ns] of the server's clock, when the robot's program had it
  readonly bitmap: ImageBitmap;
}

/** What came since the last updates, all at once: a page that is slow gets it late, but never old. */
export interface Updates {
  readonly rows: Partial<Record<TrackName, Float64Array>>;
  readonly families: readonly string[];
  readonly name?: string; // of the robot: the connection is there
  readonly lost?: boolean;
  readonly camera?: Camera;
  readonly base_T_cam?: Pose;
  readonly states: readonly RobotState[]; // the last of each phase
  readonly control?: Control;
  readonly texts: readonly { readonly name: string; readonly text: string }[];
  readonly words: readonly string[];
  readonly pictures: readonly LivePicture[]; // to look back
  readonly shown?: ShownPicture; // the newest whose tags are known
}
