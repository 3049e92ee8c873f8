/** The live line: bytes and JSON in, the filter out; it connects again by itself. */

import type { Frame, MosaicImage, Told } from "./types";

export interface Listeners {
  frame(frame: Frame): void;
  mosaic(image: MosaicImage): void;
  told(topic: Told): void;
  connected(there: boolean): void;
}

const AGAIN_MS = 1000;
const SILENT_MS = 6000; // the state is told four times a second: a line that is silent for so long is dead

export class Live {
  private line: WebSocket | null = null;
  private heard = 0;

  constructor(private readonly to: Listeners, private filter: string) {
    this.open();
    setInterval(() => this.listen(), AGAIN_MS);
  }

  choose(filter: string): void {
    this.filter = filter;
    if (this.line?.readyState === WebSocket.OPEN) this.line.send(JSON.stringify({ filter }));
  }

  private open(): void {
    const line = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    line.binaryType = "arraybuffer";
    line.onopen = () => {
      this.heard = performance.now();
      this.to.connected(true);
      this.choose(this.filter);
    };
    line.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      this.heard = performance.now();
      this.take(event.data);
    };
    line.onclose = () => this.lose(line);
    this.line = line;
  }

  /** Give up a line that is open and says nothing: its other end is gone without a word. */
  private listen(): void {
    const { line } = this;
    if (line?.readyState !== WebSocket.OPEN || performance.now() - this.heard < SILENT_MS) return;
    line.onclose = line.onmessage = null;
    line.close();
    this.lose(line);
  }

  private lose(line: WebSocket): void {
    if (line !== this.line) return;
    this.line = null;
    this.to.connected(false);
    setTimeout(() => this.open(), AGAIN_MS);
  }

  private take(data: string | ArrayBuffer): void {
    if (typeof data === "string") this.to.told(JSON.parse(data) as Told);
    else if (new Uint8Array(data, 0, 1)[0] === 0x46) this.to.frame(frameOf(data));
    else this.to.mosaic(mosaicOf(data));
  }
}

function frameOf(data: ArrayBuffer): Frame {
  const head = new DataView(data);
  return {
    newtons: head.getUint8(1) === 1,
    filter: head.getUint8(2),
    seq: head.getUint32(4, true),
    time_s: head.getFloat64(8, true),
    received_ms: head.getFloat64(16, true),
    largest: head.getFloat32(24, true),
    sum: head.getFloat32(28, true),
    values: new Float32Array(data, 32),
  };
}

export function mosaicOf(data: ArrayBuffer): MosaicImage {
  const head = new DataView(data);
  return {
    rows: head.getUint32(4, true),
    columns: head.getUint32(8, true),
    touches: head.getUint32(12, true),
    step_mm: head.getFloat32(16, true),
    corner_mm: [head.getFloat32(20, true), head.getFloat32(24, true)],
    largest: head.getFloat32(28, true),
    values: new Uint8Array(data, 32),
  };
}
