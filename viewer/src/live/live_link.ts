import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import type { Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import { add, cameraOf, type FamilyNames, kindOf, mountingOf, secondsOf, type Kind } from "../data/messages";
import type { Tracks } from "../data/tracks";
import { parseData, type Channel, type Control, type DataFrame, type RobotState, type ServerText } from "./frames";

export interface LiveEvents {
  opened(name: string): void;
  closed(): void;
  rows(): void; // the tracks have new rows
  camera(camera: Camera | undefined, base_T_cam: Pose | undefined): void;
  image(t: number, hostTime: bigint, data: Uint8Array<ArrayBuffer>): void;
  state(state: RobotState): void;
  control(control: Control): void;
  text(name: string, text: string): void;
  warned(words: string): void;
}

interface Stream {
  readonly kind: Kind;
  readonly type: string;
  readonly reader: MessageReader;
}

/** A running robot over a WebSocket: its messages are added to the tracks like those of a recording. */
export class LiveLink {
  private socket: WebSocket | undefined;
  private streams = new Map<number, Stream>();
  private state = -1; // id of the state subscription
  private start: bigint | undefined;
  private kinds = new Set<Kind>();
  private camera: Camera | undefined;
  private mounting: Pose | undefined;

  constructor(private readonly tracks: Tracks, private readonly families: FamilyNames, private readonly events: LiveEvents) {}

  connect(): void {
    this.streams = new Map();
    this.kinds = new Set();
    const socket = new WebSocket(new URL("live", location.href.replace(/^http/, "ws")), "waymark.v1");
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === "string") this.receiveText(JSON.parse(data) as ServerText);
      else this.receiveFrame(parseData(data));
    };
    socket.onclose = () => {
      this.events.closed();
      setTimeout(() => this.connect(), 1000);
    };
  }

  send(message: object): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private receiveText(message: ServerText): void {
    switch (message.op) {
      case "serverInfo": return this.events.opened(message.name);
      case "advertise": return message.channels.forEach((channel) => this.subscribe(channel));
      case "control": return this.events.control(message);
      case "text": return this.events.text(message.name, message.text);
      case "status": return this.events.warned(message.message);
    }
  }

  /** Subscribes to the first stream of each kind. */
  private subscribe(channel: Channel): void {
    if (channel.topic === "/waymark/state") this.state = channel.id;
    else {
      const kind = channel.encoding === "cdr" ? kindOf(channel.topic, channel.schemaName) : undefined;
      if (!kind || (kind !== "tf" && this.kinds.has(kind)) || channel.topic === "/tf") return;
      this.kinds.add(kind);
      this.streams.set(channel.id, { kind, type: channel.schemaName, reader: new MessageReader(parse(channel.schema, { ros2: true })) });
    }
    this.send({ op: "subscribe", subscriptions: [{ id: channel.id, channelId: channel.id }] });
  }

  private receiveFrame(frame: DataFrame | undefined): void {
    if (!frame) return;
    if (frame.subscription === this.state) return this.events.state(JSON.parse(new TextDecoder().decode(frame.data)) as RobotState);
    const stream = this.streams.get(frame.subscription);
    if (!stream) return;
    const message = stream.reader.readMessage<Record<string, unknown>>(frame.data);
    if (stream.kind === "camera" || stream.kind === "tf") {
      if (stream.kind === "camera") this.camera = cameraOf(message);
      else this.mounting = mountingOf(message) ?? this.mounting;
      return this.events.camera(this.camera, this.mounting);
    }
    this.start ??= stampOf(message);
    const t = secondsOf(message, frame.hostTime, this.start);
    if (stream.kind === "image") return this.events.image(t, frame.hostTime, (message as { data: Uint8Array }).data.slice());
    add(this.tracks, this.families, stream.kind, t, message);
    this.events.rows();
  }
}

function stampOf(message: Record<string, unknown>): bigint {
  const stamp = (message["header"] as { stamp?: { sec: number; nanosec?: number; nsec?: number } } | undefined)?.stamp;
  return stamp ? BigInt(stamp.sec) * 1_000_000_000n + BigInt(stamp.nanosec ?? stamp.nsec ?? 0) : 0n;
}
