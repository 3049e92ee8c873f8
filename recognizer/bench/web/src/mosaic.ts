/** The mosaic of a face as it grows, the face's outline and the sensor where it stands. */

import { TABLE } from "./colours";
import { able, element, fitted, say, themed } from "./dom";
import type { Answer, MosaicImage, MosaicOf, ObjectShape, Sensor } from "./types";

export class MosaicPanel {
  private readonly canvas = element<HTMLCanvasElement>("mosaic");
  private readonly ink = this.canvas.getContext("2d")!;
  private picture: OffscreenCanvas | null = null;
  private image: MosaicImage | null = null;
  private of: MosaicOf | null = null;
  private answer: Answer | null = null;
  private shape: ObjectShape | null = null;

  constructor(private readonly sensor: Sensor) {
    new ResizeObserver(() => this.paint()).observe(this.canvas);
  }

  theme(): void { this.paint(); }

  told(of: MosaicOf): void {
    this.of = of;
    able("mosaic-clear", of.touches > 0);
    const touches = `${of.touches} ${of.touches === 1 ? "touch" : "touches"}`;
    say(element("mosaic-text"), of.object ? `${of.object} ${of.face}, ${touches}` : "no touch yet");
  }

  tell(answer: Answer | null, shape: ObjectShape | null): void {
    this.answer = answer;
    this.shape = shape;
    this.paint();
  }

  show(image: MosaicImage): void {
    this.image = image;
    this.picture = null;
    if (image.rows && image.columns) this.picture = mosaicPicture(image);
    this.paint();
  }

  private paint(): void {
    fitted(this.canvas);
    const { ink, image } = this, { width, height } = this.canvas;
    ink.setTransform(1, 0, 0, 1, 0, 0);
    ink.fillStyle = themed("--field");
    ink.fillRect(0, 0, width, height);
    const face = this.shape?.name === this.of?.object ? this.shape?.faces.find((one) => one.name === this.of?.face) : undefined;
    const box = this.box(face?.loops[0]);
    if (!box) return;
    const unit = 0.92 * Math.min(width / (box.x1 - box.x0), height / (box.y1 - box.y0));
    const x = (mm: number): number => width / 2 + (mm - (box.x0 + box.x1) / 2) * unit;
    const y = (mm: number): number => height / 2 - (mm - (box.y0 + box.y1) / 2) * unit;
    if (this.picture && image) {
      const [left, up] = image.corner_mm, half = image.step_mm / 2;
      ink.imageSmoothingEnabled = true;
      ink.drawImage(this.picture, x(left - half), y(up + half), image.columns * image.step_mm * unit, image.rows * image.step_mm * unit);
    }
    ink.lineWidth = 1.5;
    ink.strokeStyle = themed("--muted");
    for (const loop of face?.loops ?? []) this.outline(loop, x, y);
    const pose = this.answer?.face === this.of?.face && this.answer?.object === this.of?.object ? this.answer?.T_face_probe : null;
    if (pose) {
      const w = (this.sensor.columns * this.sensor.pitch_mm) / 2, h = (this.sensor.rows * this.sensor.row_pitch_mm) / 2;
      ink.strokeStyle = themed("--lit");
      ink.lineWidth = 2;
      this.outline(([[-w, h], [w, h], [w, -h], [-w, -h]] as [number, number][]).map(([u, v]) => [
        pose[0]![0]! * u + pose[0]![1]! * v + pose[0]![3]!, pose[1]![0]! * u + pose[1]![1]! * v + pose[1]![3]!,
      ]), x, y);
    }
  }

  private outline(points: [number, number][], x: (mm: number) => number, y: (mm: number) => number): void {
    this.ink.beginPath();
    points.forEach(([u, v], i) => this.ink[i ? "lineTo" : "moveTo"](x(u), y(v)));
    this.ink.closePath();
    this.ink.stroke();
  }

  private box(loop: [number, number][] | undefined): { x0: number; x1: number; y0: number; y1: number } | null {
    const xs = (loop ?? []).map((p) => p[0]), ys = (loop ?? []).map((p) => p[1]);
    if (this.image && this.picture) {
      const [left, up] = this.image.corner_mm;
      xs.push(left, left + this.image.columns * this.image.step_mm);
      ys.push(up, up - this.image.rows * this.image.step_mm);
    }
    if (!xs.length) return null;
    return { x0: Math.min(...xs), x1: Math.max(...xs), y0: Math.min(...ys), y1: Math.max(...ys) };
  }
}

/** A mosaic in colours, a pixel a cell; what was not felt is left out. */
export function mosaicPicture(image: MosaicImage): OffscreenCanvas {
  const picture = new OffscreenCanvas(image.columns, image.rows), ink = picture.getContext("2d")!;
  const pixels = ink.createImageData(image.columns, image.rows);
  image.values.forEach((value, i) => {
    for (let c = 0; c < 3; c++) pixels.data[4 * i + c] = TABLE[3 * Math.max(0, value - 1) + c]!;
    pixels.data[4 * i + 3] = value ? 255 : 0;
  });
  ink.putImageData(pixels, 0, 0);
  return picture;
}
