/** The heat map with the symbols that were found, and the scale under it. */

import { TABLE, gradient } from "./colours";
import { element, say } from "./dom";
import type { Answer, Encoding, Frame, Sensor } from "./types";

const LEAST = { counts: 400, newtons: 0.5 }; // above what an unloaded sensor reads: its scale stands still
const PRESSED = 0.25; // of the scale, from which on an image is one of a touch
const HELD = 0.985; // of the scale is left after each painting

export class Heat {
  private readonly canvas = element<HTMLCanvasElement>("heat");
  private readonly ink = this.canvas.getContext("2d")!;
  private readonly small: OffscreenCanvas;
  private readonly dots: OffscreenCanvasRenderingContext2D;
  private readonly pixels: ImageData;
  private spoken = 0;
  private newtons = false;
  top = 0;
  answer: Answer | null = null;
  encodings: Encoding[] = [];
  symbols = true;

  constructor(private readonly sensor: Sensor) {
    this.small = new OffscreenCanvas(sensor.columns, sensor.rows);
    this.dots = this.small.getContext("2d")!;
    this.pixels = this.dots.createImageData(sensor.columns, sensor.rows);
    this.canvas.width = Math.round((this.canvas.height * sensor.columns * sensor.pitch_mm) / (sensor.rows * sensor.row_pitch_mm));
    element("scale-bar").style.background = gradient();
  }

  paint(frame: Frame): void {
    if (frame.newtons !== this.newtons) { // another unit: the scale begins anew
      this.newtons = frame.newtons;
      this.top = this.spoken = 0;
    }
    this.top = Math.max(frame.largest, this.top * HELD, frame.newtons ? LEAST.newtons : LEAST.counts);
    const { data } = this.pixels;
    for (let i = 0; i < frame.values.length; i++) {
      const colour = 3 * Math.min(255, Math.max(0, Math.round((frame.values[i]! / this.top) * 255)));
      data[4 * i] = TABLE[colour]!;
      data[4 * i + 1] = TABLE[colour + 1]!;
      data[4 * i + 2] = TABLE[colour + 2]!;
      data[4 * i + 3] = 255;
    }
    this.dots.putImageData(this.pixels, 0, 0);
    const { width, height } = this.canvas;
    this.ink.imageSmoothingEnabled = false;
    this.ink.drawImage(this.small, 0, 0, width, height);
    const pressed = frame.largest > PRESSED * this.top; // an image that is lifted already shows nothing of the touch
    if (pressed && this.symbols && this.answer?.object) this.draw(this.answer);
    if (pressed && this.answer?.next) this.arrow(this.answer.next);
    this.speak(frame);
  }

  /** Symbols as strokes, the sensor's axes: x right, y up. */
  private draw(answer: Answer): void {
    const encoding = answer.window && this.encodings[answer.window.encoding];
    if (!encoding) return;
    const ink = this.ink, unit = this.canvas.width / (this.sensor.columns * this.sensor.pitch_mm);
    const turn = answer.turn ?? 0;
    for (const [width, colour] of [[5, "rgb(0 0 0 / .55)"], [2, "#fff"]] as const) {
      ink.lineWidth = width;
      ink.strokeStyle = colour;
      ink.lineCap = "round";
      for (const [, , label, x, y] of answer.symbols) {
        ink.save();
        ink.translate(this.canvas.width / 2 + x * unit, this.canvas.height / 2 - y * unit);
        ink.rotate(-turn);
        ink.scale(unit, -unit);
        ink.beginPath();
        for (const [a, b] of encoding.strokes[label] ?? []) {
          ink.moveTo(a[0], a[1]);
          ink.lineTo(b[0], b[1]);
        }
        ink.restore();
        ink.stroke();
      }
    }
  }

  /** Where to touch next: an arrow from the middle, the sensor's axes. */
  private arrow(next: { dx_mm: number; dy_mm: number }): void {
    const away = Math.hypot(next.dx_mm, next.dy_mm);
    if (away < 0.5) return;
    const ink = this.ink, unit = this.canvas.width / (this.sensor.columns * this.sensor.pitch_mm);
    const [u, v] = [next.dx_mm / away, -next.dy_mm / away], long = Math.min(away * unit, 0.45 * this.canvas.width);
    const [x0, y0] = [this.canvas.width / 2, this.canvas.height / 2], [x1, y1] = [x0 + u * long, y0 + v * long];
    for (const [width, colour] of [[9, "rgb(0 0 0 / .6)"], [4, "#ffd60a"]] as const) {
      ink.lineWidth = width;
      ink.strokeStyle = colour;
      ink.lineCap = ink.lineJoin = "round";
      ink.beginPath();
      ink.moveTo(x0, y0);
      ink.lineTo(x1, y1);
      ink.moveTo(x1 - 16 * (u + v), y1 - 16 * (v - u));
      ink.lineTo(x1, y1);
      ink.lineTo(x1 - 16 * (u - v), y1 - 16 * (v + u));
      ink.stroke();
    }
  }

  private speak(frame: Frame): void {
    const now = performance.now();
    if (now - this.spoken < 1000) return;
    this.spoken = now;
    const unit = frame.newtons ? "N" : "counts", digits = frame.newtons ? 2 : 0;
    say(element("scale"), `0 to ${this.top.toFixed(digits)} ${unit}`);
    this.canvas.setAttribute("aria-label",
      `Heat map of the ${this.sensor.rows} by ${this.sensor.columns} readings, largest ${frame.largest.toFixed(digits)} ${unit}`);
  }
}
