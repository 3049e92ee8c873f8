/** Checks as guided steps: how the sensor is mounted, and how the part was printed. */

import { post } from "./api";
import { element, say } from "./dom";
import type { ObjectShape, Status, TouchRecord } from "./types";

interface Mounting { found: boolean; words: string; as_drawn?: boolean; turn_deg?: number; flip?: string }
interface Prints { object: string; touches: number; parts: { part: string; verdict: string; words: string; sizes: string; touches: number }[]; few: string[] }
const ENOUGH = 25; // touches that a print is told from
const APART_MS = 150;

/** What the checks need of the page. */
export interface Bench {
  shape(): ObjectShape | null;
  touches(): TouchRecord[];
  press(face: string, x_mm: number, y_mm: number, theta_deg: number): Promise<void>;
}

export class MountingCheck {
  private readonly dialog = element<HTMLDialogElement>("mounting");
  private after = Infinity; // touches with a higher number are placed ones
  private flip = "";

  constructor(private readonly bench: Bench) {
    element("mounting-open").addEventListener("click", () => this.open());
    element("mounting-press").addEventListener("click", () => void this.press().catch(() => undefined));
    element("mounting-use").addEventListener("click", () => void this.use().catch(() => undefined));
    element("mounting-face").addEventListener("change", () => this.begin());
    this.dialog.addEventListener("close", () => { this.after = Infinity; });
  }

  status(status: Status): void {
    element<HTMLButtonElement>("mounting-open").disabled = status.feed.state !== "live" && status.feed.state !== "replay";
    element("mounting-press").hidden = !status.simulated;
  }

  /** A touch was read: is it the one that was asked for? */
  tell(record: TouchRecord): void {
    if (record.number <= this.after || !record.answer || record.state === "reading") return;
    this.after = Infinity;
    void this.ask(record.number).catch(() => undefined);
  }

  private open(): void {
    const faces = this.bench.shape()?.faces.filter((face) => !face.blank && !face.round) ?? [];
    element("mounting-face").replaceChildren(...faces.map((face) => new Option(face.name, face.name)));
    this.begin();
    this.dialog.showModal();
  }

  private begin(): void {
    const { name } = this.bench.shape() ?? { name: "" }, face = element<HTMLSelectElement>("mounting-face").value;
    say(element("mounting-ask"), `Touch ${name} ${face} near its middle, the sensor's columns along the face's first edge (x, from its first corner to its second).`);
    say(element("mounting-told"), "");
    element("mounting-use").hidden = true;
    this.after = Math.max(0, ...this.bench.touches().map((one) => one.number));
  }

  private async press(): Promise<void> {
    const face = this.bench.shape()?.faces.find((one) => one.name === element<HTMLSelectElement>("mounting-face").value);
    if (!face?.centres.length) return;
    this.begin();
    const mean = (k: 0 | 1): number => face.centres.reduce((sum, one) => sum + one[k], 0) / face.centres.length;
    await this.bench.press(face.name, mean(0), mean(1), 0);
  }

  private async ask(touch: number): Promise<void> {
    say(element("mounting-told"), "Trying the eight ways in which the image can lie…");
    const found = await post<Mounting>("mounting", { touch, object: this.bench.shape()?.name ?? "", face: element<HTMLSelectElement>("mounting-face").value });
    this.flip = found.flip ?? "";
    say(element("mounting-told"), found.found ? `${found.words}; the touch is ${Math.abs(found.turn_deg ?? 0).toFixed(0)}° off the direction that was asked for.`
      : `${found.words}. Touch again as asked: the face that is named, within 40 degrees.`);
    element("mounting-use").hidden = !found.found || (found.as_drawn ?? true);
    if (!found.found) this.after = touch;
  }

  private async use(): Promise<void> {
    await post("flip", { changes: this.flip });
    say(element("mounting-told"), "Images are turned back from now on.");
    element("mounting-use").hidden = true;
  }
}

export class PrintCheck {
  private readonly dialog = element<HTMLDialogElement>("print");
  private after = 0;
  private pressing = false;

  constructor(private readonly bench: Bench) {
    element("print-open").addEventListener("click", () => this.open());
    element("print-press").addEventListener("click", () => void this.press().catch(() => { this.pressing = false; }));
    element("print-estimate").addEventListener("click", () => void this.estimate().catch(() => say(element("print-told"), "")));
    element("print-store").addEventListener("click", () => void this.store().catch(() => undefined));
    this.dialog.addEventListener("close", () => { this.pressing = false; });
  }

  status(status: Status): void {
    element<HTMLButtonElement>("print-open").disabled = status.feed.state !== "live" && status.feed.state !== "replay";
    element("print-press").hidden = !status.simulated;
  }

  tell(): void {
    if (!this.dialog.open) return;
    const faces = new Map<string, number>(), mine = this.placed();
    for (const { answer } of mine) faces.set(answer!.face!, (faces.get(answer!.face!) ?? 0) + 1);
    const told = [...faces].map(([face, count]) => `${face}: ${count}`).join(", ");
    element<HTMLProgressElement>("print-count").value = Math.min(1, mine.length / ENOUGH);
    say(element("print-ask"), `${mine.length} of ${ENOUGH} touches${told ? ` (${told})` : ""}. Touch all over one part of ${this.bench.shape()?.name ?? "it"}: near its corners as well.`);
    element<HTMLButtonElement>("print-estimate").disabled = mine.length < 10;
  }

  private placed(): TouchRecord[] {
    return this.bench.touches().filter((one) => one.number > this.after && one.answer?.object === this.bench.shape()?.name);
  }

  private open(): void {
    this.after = Math.max(0, ...this.bench.touches().map((one) => one.number));
    say(element("print-told"), "");
    element("print-parts").replaceChildren();
    element("print-store").hidden = true;
    this.dialog.showModal();
    this.tell();
  }

  /** Let the simulated probe touch one face all over. */
  private async press(): Promise<void> {
    const faces = this.bench.shape()?.faces.filter((face) => !face.blank && !face.round) ?? [];
    const face = faces.find((one) => one.name === this.placed()[0]?.answer?.face) ?? faces[0];
    if (!face?.centres.length || this.pressing) return;
    this.pressing = true;
    for (let k = 0; this.pressing && this.placed().length < ENOUGH && k < 2 * ENOUGH; k++) {
      const [x, y] = face.centres[(k * 17) % face.centres.length]!, before = this.bench.touches().length;
      await this.bench.press(face.name, x, y, (k * 37) % 360);
      for (let i = 0; i < 60 && !(this.bench.touches().length > before && this.bench.touches().at(-1)?.answer); i++) {
        await new Promise((done) => setTimeout(done, APART_MS));
      }
    }
    this.pressing = false;
  }

  private async estimate(): Promise<void> {
    this.pressing = false;
    say(element("print-told"), "Fitting each touch with a print that may be stretched…");
    const found = await post<Prints>("as-built", { do: "estimate", after: this.after, material: element<HTMLInputElement>("print-material").value });
    say(element("print-told"), `${found.object}, from ${found.touches} touches:`);
    element("print-parts").replaceChildren(...[...found.parts.map((one) => `${one.part}: ${one.words}. ${one.sizes}; ${one.touches} touches.`), ...found.few].map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    }));
    element("print-store").hidden = !found.parts.length;
  }

  private async store(): Promise<void> {
    await post("as-built", { do: "store" });
    say(element("print-told"), "Kept in the database: every later pose on the part is corrected by it.");
    element("print-store").hidden = true;
  }
}
