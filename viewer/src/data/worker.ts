// Reads the recording in a worker, so that the page never blocks.
import { FamilyNames } from "./messages";
import type { Answer, Request } from "./protocol";
import { BlobSource, HttpSource } from "./range_source";
import { Recording } from "./recording";
import { emptyTracks, trackNames, type TrackName } from "./tracks";

let recording: Recording | undefined;
const post = (answer: Answer): void => self.postMessage(answer);
const failed = (error: unknown): void => post({ type: "failed", words: error instanceof Error ? error.message : String(error) });

async function open(source: File | string): Promise<void> {
  const opened = await Recording.open(typeof source === "string" ? new HttpSource(source) : new BlobSource(source, source.name));
  recording = opened;
  const info = await opened.info();
  post({ type: "opened", info });
  if (info.hasImages) await image(opened, 0); // before anything else is read
  const tracks = emptyTracks(), families = new FamilyNames();
  const sent = new Map<TrackName, number>();
  const send = (progress: number, complete: boolean): void => {
    const rows: Partial<Record<TrackName, Float64Array>> = {};
    for (const name of trackNames) {
      const from = sent.get(name) ?? 0;
      if (tracks[name].length === from) continue;
      rows[name] = tracks[name].since(from);
      sent.set(name, tracks[name].length);
    }
    post({ type: "tracks", rows, families: families.names, progress, complete });
  };
  for await (const progress of opened.overview(tracks, families)) send(progress, false);
  send(1, true);
}

const image = (from: Recording, t: number): Promise<void> =>
  from.image(t).then((found) => post({ type: "image", t, image: found })).catch((error: unknown) => {
    post({ type: "image", t, image: undefined });
    failed(error);
  });

self.onmessage = ({ data }: MessageEvent<Request>): void => {
  if (data.ask === "open") open(data.source).catch(failed);
  else if (recording) void image(recording, data.t);
};
