// The connection to a running robot, in a worker: messages are read as they arrive, even while the page is drawing.
import { compressedImageOf } from "../data/images";
import { LiveLink } from "./live_link";
import type { Updates, ToLink } from "./link_protocol";
import { UpdateBox } from "./update_box";

const box = new UpdateBox();
let requested = false; // the page waits for updates
let sending = false;

const link = new LiveLink(box.tracks, box.families, {
  opened: (name) => { box.opened(name); void send(); },
  closed: () => { box.lost(); void send(); },
  warned: (words) => { box.warn(words); void send(); },
  rows: () => { box.grown(); void send(); },
  camera: (camera, base_T_cam) => { box.setCamera(camera, base_T_cam); void send(); },
  image: (t, hostTime, data) => { box.image(t, hostTime, data); void send(); },
  state: (state) => { box.state(state); void send(); },
  control: (control) => { box.controlled(control); void send(); },
  text: (name, text) => { box.text(name, text); void send(); },
});

async function send(): Promise<void> {
  if (!requested || sending || !box.full) return;
  sending = true;
  const image = box.takeImage();
  const bitmap = image && (await bitmapOf(image.bytes));
  const updates: Updates = { ...box.take(), ...(image && bitmap ? { shown: { t: image.t, hostTime: image.hostTime, bitmap } } : {}) };
  requested = sending = false;
  self.postMessage(updates, { transfer: bitmap ? [bitmap] : [] });
}

async function bitmapOf(bytes: Uint8Array<ArrayBuffer>): Promise<ImageBitmap | undefined> {
  try {
    const image = compressedImageOf(bytes);
    return image.kind === "file" ? await createImageBitmap(new Blob([image.bytes], { type: image.mime })) : undefined;
  } catch (error) {
    box.warn(String(error));
    return undefined;
  }
}

self.onmessage = ({ data }: MessageEvent<ToLink>): void => {
  if ("send" in data) return link.send(data.send);
  requested = true;
  void send();
};
link.connect();
