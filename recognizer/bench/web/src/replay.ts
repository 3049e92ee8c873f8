/** The time line of a recording that is played. */

import { get, post } from "./api";
import { element, fitted, say, themed } from "./dom";
import type { Status } from "./types";

export class Replay {
  private readonly seek = element<HTMLInputElement>("seek");
  private readonly canvas = element<HTMLCanvasElement>("strength");
  private strength: number[] = [];
  private port = "";
  private status: Status | null = null;
  private held = false;

  constructor() {
    element("play").addEventListener("click", () => void post("replay", { playing: !this.status?.feed.playing }).catch(() => undefined));
    element("speed").addEventListener("change", (event) => void post("replay", { speed: Number((event.target as HTMLSelectElement).value) }).catch(() => undefined));
    this.seek.addEventListener("input", () => this.go());
    new ResizeObserver(() => this.paint()).observe(this.canvas);
  }

  theme(): void { this.paint(); }

  tell(status: Status): void {
    this.status = status;
    const playing = status.feed.state === "replay";
    element("timeline-panel").hidden = !playing;
    if (!playing) {
      this.port = "";
      return;
    }
    if (status.port !== this.port) {
      this.port = status.port;
      void get<{ strength: number[] }>("timeline").then((line) => {
        this.strength = line.strength;
        this.paint();
      }).catch(() => undefined);
    }
    const { at = 0, seconds = 0 } = status.feed;
    if (!this.held) this.seek.value = String(seconds ? Math.round((1000 * at) / seconds) : 0);
    say(element("place"), `${at.toFixed(1)} of ${seconds.toFixed(1)} s`);
    this.seek.setAttribute("aria-valuetext", `${at.toFixed(1)} of ${seconds.toFixed(1)} seconds`);
    say(element("play"), status.feed.playing ? "Pause" : "Play");
  }

  private asked = 0;

  /** Go where the slider is, at most ten times a second; meanwhile it stays there. */
  private go(): void {
    const at_s = (Number(this.seek.value) / 1000) * (this.status?.feed.seconds ?? 0);
    this.held = true;
    clearTimeout(this.asked);
    this.asked = setTimeout(() => {
      void post("replay", { at_s }).catch(() => undefined).finally(() => { this.held = false; });
    }, 100);
  }

  private paint(): void {
    fitted(this.canvas);
    const ink = this.canvas.getContext("2d")!, { width, height } = this.canvas;
    ink.clearRect(0, 0, width, height);
    ink.fillStyle = themed("--accent");
    ink.globalAlpha = 0.55;
    const n = this.strength.length;
    this.strength.forEach((value, i) => {
      const bar = Math.max(1, value * height);
      ink.fillRect((i * width) / n, height - bar, width / n + 0.5, bar);
    });
    ink.globalAlpha = 1;
  }
}
