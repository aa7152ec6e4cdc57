import type { Picture } from "./pictures";
import type { RecordingInfo } from "./recording";
import type { TrackName } from "./tracks";

/** What the page asks of its worker, and what it is told. */
export type Request = { readonly ask: "open"; readonly source: File | string } | { readonly ask: "picture"; readonly t: number };

export type Answer =
  | { readonly tell: "opened"; readonly info: RecordingInfo }
  | { readonly tell: "tracks"; readonly rows: Partial<Record<TrackName, Float64Array>>; readonly families: readonly string[];
      readonly progress: number; readonly complete: boolean }
  | { readonly tell: "picture"; readonly t: number; readonly picture: Picture | undefined }
  | { readonly tell: "failed"; readonly words: string };
