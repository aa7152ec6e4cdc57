import type { SourceImage } from "./images";
import type { RecordingInfo } from "./recording";
import type { TrackName } from "./tracks";

/** Requests of the page to its worker, and the answers. */
export type Request = { readonly ask: "open"; readonly source: File | string } | { readonly ask: "image"; readonly t: number };

export type Answer =
  | { readonly type: "opened"; readonly info: RecordingInfo }
  | { readonly type: "tracks"; readonly rows: Partial<Record<TrackName, Float64Array>>; readonly families: readonly string[];
      readonly progress: number; readonly complete: boolean }
  | { readonly type: "image"; readonly t: number; readonly image: SourceImage | undefined }
  | { readonly type: "failed"; readonly words: string };
