/** What is painted on the faces of the part: how far they were felt, what they promise, what was felt there. */

import { get } from "./api";
import { TABLE } from "./colours";
import { element, say } from "./dom";
import { mosaicOf } from "./live";
import { mosaicPicture } from "./mosaic";
import type { Part } from "./part";
import type { FacePicture, FaceShape, MosaicImage, ObjectShape, Promised, Sensor, TouchRecord } from "./types";

const PIXELS = 256; // along the longer side of a face
type Kind = "plain" | "coverage" | "promise" | "mosaic";

export class Tint {
  private readonly list = element("face-list");
  private kind: Kind = "plain";
  private shape: ObjectShape | null = null;
  private told = "";
  private promises = new Map<string, Promised>();
  private mosaics = new Map<string, MosaicImage>();

  constructor(private readonly part: Part, private readonly sensor: Sensor, private readonly records: () => TouchRecord[]) {
    element("tint").addEventListener("change", (event) => {
      this.kind = (event.target as HTMLSelectElement).value as Kind;
      void this.update().catch(() => undefined);
    });
  }

  /** Another object is shown. */
  show(shape: ObjectShape): void {
    this.shape = shape;
    this.promises.clear();
    this.mosaics.clear();
    this.told = "";
    void this.update().catch(() => undefined);
  }

  /** A touch was answered, or forgotten: paint again what depends on it. */
  touched(): void {
    if (this.kind === "coverage" || this.kind === "mosaic") void this.update().catch(() => undefined);
  }

  private async update(): Promise<void> {
    const { shape, kind } = this;
    if (!shape) return;
    if (kind === "promise" && !this.promises.size) {
      const { faces } = await get<{ faces: Record<string, Promised> }>(`promise/${encodeURIComponent(shape.name)}`);
      this.promises = new Map(Object.entries(faces));
    }
    if (kind === "mosaic") await this.load(shape);
    if (this.shape !== shape || this.kind !== kind) return; // another one was chosen meanwhile
    this.paint(shape);
  }

  /** Take the mosaics that have grown. */
  private async load(shape: ObjectShape): Promise<void> {
    const name = encodeURIComponent(shape.name);
    const { faces } = await get<{ faces: Record<string, number> }>(`mosaics/${name}`);
    for (const face of [...this.mosaics.keys()]) if (!(face in faces)) this.mosaics.delete(face);
    for (const [face, touches] of Object.entries(faces)) {
      if (this.mosaics.get(face)?.touches === touches) continue;
      const answer = await fetch(`/api/mosaics/${name}/${encodeURIComponent(face)}`);
      if (answer.ok) this.mosaics.set(face, mosaicOf(await answer.arrayBuffer()));
    }
  }

  private paint(shape: ObjectShape): void {
    const colours = new Map<string, string>(), pictures = new Map<string, FacePicture>(), rows: [string, string, string][] = [];
    for (const face of shape.faces) {
      if (face.blank || this.kind === "plain") continue;
      if (this.kind === "promise") {
        const promised = this.promises.get(face.name), colour = promised ? shade(promised.at_once) : "";
        if (colour) colours.set(face.name, colour);
        rows.push([face.name, promised ? words(promised) : "nothing is promised of single touches", colour]);
      } else if (this.kind === "coverage") {
        const { picture, share, touches } = this.coverage(face);
        if (touches) pictures.set(face.name, picture);
        rows.push([face.name, `${percent(share)} felt by ${touches} ${touches === 1 ? "touch" : "touches"}`, shade(share)]);
      } else {
        const image = this.mosaics.get(face.name);
        if (image?.rows) pictures.set(face.name, pictureOf(image));
        rows.push([face.name, image ? `mosaic of ${image.touches} ${image.touches === 1 ? "touch" : "touches"}` : "not touched yet", ""]);
      }
    }
    this.part.tint(colours, pictures, this.kind === "mosaic");
    this.say(rows);
  }

  /** The places of a face that touches have felt: a picture and the share of the face. */
  private coverage(face: FaceShape): { picture: FacePicture; share: number; touches: number } {
    const picture = blankPicture(face), { canvas, x0, y0, x1, y1 } = picture, ink = canvas.getContext("2d", { willReadFrequently: true })!;
    const x = (mm: number): number => ((mm - x0) / (x1 - x0)) * canvas.width, y = (mm: number): number => ((y1 - mm) / (y1 - y0)) * canvas.height;
    const line = (points: [number, number][]): void => points.forEach(([u, v], i) => ink[i ? "lineTo" : "moveTo"](x(u), y(v)));
    ink.beginPath();
    for (const loop of face.loops) {
      line(loop);
      ink.closePath();
    }
    ink.fill("evenodd");
    const all = filled(ink, canvas, 127);
    ink.save();
    ink.clip("evenodd");
    ink.clearRect(0, 0, canvas.width, canvas.height);
    const w = (this.sensor.columns * this.sensor.pitch_mm) / 2, h = (this.sensor.rows * this.sensor.row_pitch_mm) / 2;
    let touches = 0;
    for (const { answer } of this.records()) {
      const T = answer?.T_face_probe;
      if (!T || answer.object !== this.shape?.name || answer.face !== face.name) continue;
      touches++;
      ink.fillStyle = "rgb(31 158 137 / .55)";
      ink.beginPath();
      line(([[-w, h], [w, h], [w, -h], [-w, -h]] as const).map(([u, v]) => [
        T[0]![0]! * u + T[0]![1]! * v + T[0]![3]!, T[1]![0]! * u + T[1]![1]! * v + T[1]![3]!]));
      ink.fill();
    }
    ink.restore();
    return { picture, share: all ? filled(ink, canvas, 63) / all : 0, touches };
  }

  private say(rows: [string, string, string][]): void {
    const told = JSON.stringify(rows);
    if (told === this.told) return;
    this.told = told;
    faceRows(this.list, rows);
  }
}

/** List faces with what is said of each, and its colour. */
export function faceRows(list: HTMLElement, rows: [string, string, string][]): void {
  list.hidden = !rows.length;
  list.replaceChildren(...rows.map(([name, text, colour]) => {
    const item = document.createElement("li"), mark = document.createElement("i"), label = document.createElement("span");
    mark.style.background = colour || "var(--line)";
    mark.setAttribute("aria-hidden", "true");
    say(label, `${name}: ${text}`);
    item.append(mark, label);
    return item;
  }));
}

function blankPicture(face: FaceShape): FacePicture {
  const xs = face.loops.flat().map((p) => p[0]), ys = face.loops.flat().map((p) => p[1]);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const unit = PIXELS / Math.max(x1 - x0, y1 - y0), canvas = document.createElement("canvas");
  canvas.width = Math.max(1, Math.round((x1 - x0) * unit));
  canvas.height = Math.max(1, Math.round((y1 - y0) * unit));
  return { canvas, x0, y0, x1, y1 };
}

/** A mosaic with a margin of nothing, which a texture repeats beyond its border. */
function pictureOf({ rows, columns, step_mm, corner_mm, ...image }: MosaicImage): FacePicture {
  const canvas = document.createElement("canvas"), [x0, y1] = [corner_mm[0] - 1.5 * step_mm, corner_mm[1] + 1.5 * step_mm];
  canvas.width = columns + 2;
  canvas.height = rows + 2;
  canvas.getContext("2d")!.drawImage(mosaicPicture({ rows, columns, step_mm, corner_mm, ...image }), 1, 1);
  return { canvas, x0, y1, x1: x0 + canvas.width * step_mm, y0: y1 - canvas.height * step_mm };
}

function filled(ink: CanvasRenderingContext2D, canvas: HTMLCanvasElement, least: number): number {
  const { data } = ink.getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 3; i < data.length; i += 4) if (data[i]! > least) count++;
  return count;
}

export function shade(share: number): string {
  const at = 3 * Math.round(255 * Math.max(0, Math.min(1, share)));
  return `rgb(${TABLE[at]}, ${TABLE[at + 1]}, ${TABLE[at + 2]})`; // with commas: three.js knows no others
}

function percent(share: number): string {
  const whole = Math.round(100 * share), half = Math.abs(100 * share - whole) === 0.5;
  return `${half && whole % 2 ? whole - 1 : whole} %`; // halves to the even number, as the command has it
}

export function words(promised: Promised): string {
  const three = promised.within_three;
  return `${percent(promised.at_once)} of touches answered at once${typeof three === "number" ? `, ${percent(three)} within three` : ""}`;
}
