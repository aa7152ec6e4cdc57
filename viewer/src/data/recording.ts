import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { decompress as unzstd } from "fzstd";
import * as lz4 from "lz4js";
import type { Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import { add, addLatency, cameraOf, FamilyNames, kindOf, mountingOf, secondsOf, type Kind } from "./messages";
import { compressedImageOf, imageOf, type SourceImage } from "./images";
import type { RangeSource } from "./range_source";
import type { Tracks } from "./tracks";

export interface RecordingInfo {
  readonly name: string;
  readonly duration: number;
  readonly messages: number;
  readonly topics: readonly string[];
  readonly metadata: Readonly<Record<string, string>>;
  /** Attachments that are text: map.yaml, route.yaml, robot.yaml, truth/world.yaml … */
  readonly texts: Readonly<Record<string, string>>;
  readonly camera?: Camera;
  readonly base_T_cam?: Pose;
  readonly hasImages: boolean;
}

const decompressHandlers = {
  zstd: (bytes: Uint8Array, size: bigint) => unzstd(bytes, new Uint8Array(Number(size))),
  lz4: (bytes: Uint8Array, size: bigint) => lz4.decompress(bytes, Number(size)),
};
const maxTextBytes = 8e6; // larger attachments are ignored

interface Topic {
  readonly kind: Kind;
  readonly type: string;
  readonly reader: MessageReader;
}

/** The namespace of a camera's topic: "/left" of "/left/tags". */
const cameraTopic = (topic: string): string => topic.slice(0, topic.lastIndexOf("/"));

/** A recording read by its index: parts of the file are read on demand. */
export class Recording {
  private readonly topics = new Map<number, Topic>();
  private readonly names = new Map<Kind, string[]>();
  private readonly start: bigint;

  private constructor(private readonly mcap: McapIndexedReader, readonly name: string) {
    this.start = mcap.statistics?.messageStartTime ?? 0n;
    for (const channel of mcap.channelsById.values()) {
      const schema = mcap.schemasById.get(channel.schemaId);
      const kind = schema ? kindOf(channel.topic, schema.name) : undefined;
      if (!schema || !kind || channel.messageEncoding !== "cdr" || schema.encoding !== "ros2msg") continue;
      const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
      this.topics.set(channel.id, { kind, type: schema.name, reader: new MessageReader(definitions) });
      this.names.set(kind, [...(this.names.get(kind) ?? []), channel.topic].sort());
    }
  }

  static async open(source: RangeSource): Promise<Recording> {
    const readable = { size: () => source.size(), read: (offset: bigint, size: bigint) => source.read(offset, size) };
    const head = await source.read(0n, (await source.size()) < 8n ? await source.size() : 8n);
    if (head.length === 0) throw new Error(`${source.name}: the file is empty. Record it again, or copy it again from its source.`);
    if ((head[0] === 0x89 && head[1] === 0x50) || (head[0] === 0xff && head[1] === 0xd8)) // PNG, JPEG
      throw new Error(`${source.name}: an image, not a recording. Detect its tags with: waymark detect ${source.name}`);
    if (head.length < 8 || head[0] !== 0x89 || String.fromCharCode(...head.slice(1, 5)) !== "MCAP")
      throw new Error(`${source.name}: not an MCAP recording. Convert other formats with: waymark convert ${source.name} out.mcap`);
    try {
      return new Recording(await McapIndexedReader.Initialize({ readable, decompressHandlers, messageIndexCacheSizeBytes: 16e6 }), source.name);
    } catch (error) {
      throw new Error(`${source.name}: no index: the file is truncated or still being written. ` +
        `waymark recover ${source.name} -o whole.mcap adds one. (${(error as Error).message})`);
    }
  }

  async info(): Promise<RecordingInfo> {
    const { statistics } = this.mcap;
    const metadata: Record<string, string> = {};
    for await (const record of this.mcap.readMetadata({ name: "waymark" })) for (const [key, value] of record.metadata) metadata[key] = value;
    const texts: Record<string, string> = {};
    for await (const file of this.mcap.readAttachments())
      if (/\.(ya?ml|txt|json)$/.test(file.name) && file.data.length < maxTextBytes) texts[file.name] = new TextDecoder().decode(file.data);
    const camera = await this.first("camera", cameraOf);
    const base_T_cam = await this.first("tf", mountingOf);
    return {
      name: this.name, metadata, texts, ...(camera ? { camera } : {}), ...(base_T_cam ? { base_T_cam } : {}),
      duration: Number((statistics?.messageEndTime ?? 0n) - this.start) * 1e-9,
      messages: Number(statistics?.messageCount ?? 0n),
      topics: [...this.mcap.channelsById.values()].map((channel) => channel.topic).sort(),
      hasImages: this.names.has("image"),
    };
  }

  /** Reads all small messages into the tracks, in order of log time; yields the progress, from 0 to 1, about every `everyMs`. */
  async *overview(tracks: Tracks, families: FamilyNames, everyMs = 100): AsyncGenerator<number> {
    // Only the first topic of each kind by name; several would be mixed up.
    const topics = (["truth", "odometry", "estimate", "uncertain", "command", "tags", "nis"] as const)
      .flatMap((kind) => this.names.get(kind)?.slice(0, 1) ?? []);
    const tags = this.names.get("tags")?.[0];
    topics.push(...(this.names.get("unreliable") ?? []).filter((topic) => tags !== undefined && cameraTopic(topic) === cameraTopic(tags)));
    if (topics.length === 0) return;
    const span = Number((this.mcap.statistics?.messageEndTime ?? this.start) - this.start) || 1;
    let reported = performance.now();
    for await (const message of this.mcap.readMessages({ topics, validateCrcs: false })) {
      const topic = this.topics.get(message.channelId);
      if (!topic) continue;
      const decoded = topic.reader.readMessage<Record<string, unknown>>(message.data);
      const t = secondsOf(decoded, message.logTime, this.start);
      add(tracks, families, topic.kind, t, decoded);
      if (topic.kind === "tags") addLatency(tracks, t, Number(message.logTime - this.start) * 1e-9);
      if (performance.now() - reported < everyMs) continue;
      reported = performance.now();
      yield Number(message.logTime - this.start) / span;
    }
  }

  /** The last image not later than t [s]; reads the file twice, independent of its length. */
  async image(t: number): Promise<SourceImage | undefined> {
    const topic = this.names.get("image")?.[0];
    if (topic === undefined) return undefined;
    const endTime = this.start + BigInt(Math.round(t * 1e9));
    for await (const message of this.mcap.readMessages({ topics: [topic], endTime, reverse: true, validateCrcs: false })) {
      const { reader, type } = this.topics.get(message.channelId)!;
      const image = reader.readMessage<Parameters<typeof imageOf>[0]>(message.data);
      return type.endsWith("CompressedImage") ? compressedImageOf(image.data) : imageOf(image);
    }
    return undefined;
  }

  private async first<T>(kind: Kind, decode: (message: Record<string, unknown>) => T | undefined): Promise<T | undefined> {
    const topics = this.names.get(kind);
    if (!topics) return undefined;
    let tried = 0;
    for await (const message of this.mcap.readMessages({ topics, validateCrcs: false })) {
      const value = decode(this.topics.get(message.channelId)!.reader.readMessage<Record<string, unknown>>(message.data));
      if (value !== undefined || ++tried > 100) return value;
    }
    return undefined;
  }
}
