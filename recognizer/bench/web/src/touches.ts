/** The time line of touches: every touch an event to go back to, name, compare, delete or export. */

import { get, post, remove } from "./api";
import { when } from "./answer";
import { able, element, say } from "./dom";
import type { TouchRecord } from "./types";

export class Touches {
  private readonly list = element("touch-list");
  private readonly records = new Map<number, TouchRecord>();
  private readonly buttons = new Map<number, HTMLButtonElement>();
  private chosen: number | null = null; // of the past; null: what is felt now
  private beside: number | null = null; // compared with the chosen one

  constructor(private readonly show: (record: TouchRecord | null, past: boolean) => void) {
    element("touch-live").addEventListener("click", () => this.live());
    element("touch-delete").addEventListener("click", () => void this.forget().catch(() => undefined));
    element("touch-name").addEventListener("change", (event) => void this.rename((event.target as HTMLInputElement).value).catch(() => undefined));
    this.list.addEventListener("keydown", (event) => this.key(event));
  }

  /** Take all touches as the server has them: made before the page was opened, named or deleted by others. */
  async load(): Promise<void> {
    const { touches, newest } = await get<{ touches: TouchRecord[]; newest: number }>("touches");
    const known = new Set(touches.map((record) => record.number));
    for (const number of [...this.records.keys()]) if (number <= newest && !known.has(number)) this.drop(number);
    if (this.chosen !== null && !this.records.has(this.chosen)) this.chosen = this.beside = null;
    for (const record of touches) if (record.number < newest || !this.records.has(record.number)) this.put(record); // the line tells the newest
    for (const number of [...this.records.keys()].sort((a, b) => a - b)) this.list.append(this.buttons.get(number)!.parentElement!);
    if (this.chosen === null) this.now();
    else this.mark();
  }

  tell(record: TouchRecord): void {
    const before = this.newest; // the line tells the newest touch alone: how the one before ended may be missing
    if (before && before.number < record.number && (before.contact || !before.answer)) void this.load().catch(() => undefined);
    if (record.dropped) this.drop(record.number);
    else this.put(record);
    if (this.chosen === null) this.now();
  }

  /** The record that the panels show, unless one of the past was chosen. */
  get newest(): TouchRecord | null {
    return [...this.records.values()].reduce<TouchRecord | null>((a, b) => (a && a.number > b.number ? a : b), null);
  }

  get all(): TouchRecord[] { return [...this.records.values()]; }

  live(): void {
    this.chosen = this.beside = null;
    this.now();
  }

  private now(): void {
    this.mark();
    this.show(this.newest, false);
  }

  private put(record: TouchRecord): void {
    this.records.set(record.number, record);
    let button = this.buttons.get(record.number);
    if (!button) {
      const item = document.createElement("li");
      button = document.createElement("button");
      button.type = "button";
      button.addEventListener("click", (event) => this.choose(record.number, event.shiftKey));
      item.append(button);
      this.buttons.set(record.number, button);
      this.list.append(item);
      this.list.scrollLeft = this.list.scrollWidth;
    }
    button.dataset["state"] = record.state;
    const { answer } = record;
    const what = record.state === "answered" ? `${answer!.object} ${answer!.face}` : record.state === "refused" ? answer!.because : "…";
    say(button, `${record.number}  ${record.name || what}`);
    button.title = `${when(record)}  ${what}`;
  }

  private drop(number: number): void {
    this.records.delete(number);
    this.buttons.get(number)?.parentElement?.remove();
    this.buttons.delete(number);
  }

  private choose(number: number, second: boolean): void {
    if (second && this.chosen !== null && this.chosen !== number) this.beside = number;
    else [this.chosen, this.beside] = [number, null];
    this.mark();
    this.show(this.records.get(this.chosen!)!, true);
  }

  private mark(): void {
    for (const [number, button] of this.buttons) {
      button.setAttribute("aria-pressed", String(number === this.chosen || number === this.beside));
    }
    const record = this.chosen === null ? null : this.records.get(this.chosen) ?? null;
    for (const id of ["touch-live", "touch-delete"]) element<HTMLButtonElement>(id).disabled = record === null;
    for (const id of ["touch-csv", "touch-h5"]) able(id, this.records.size > 0);
    const name = element<HTMLInputElement>("touch-name");
    name.disabled = record === null;
    if (document.activeElement !== name) name.value = record?.name ?? "";
    const other = this.beside === null ? null : this.records.get(this.beside) ?? null;
    say(element("touch-compared"), record && other ? compared(record, other)
      : record ? "Shift and click another touch to compare" : `${this.records.size} ${this.records.size === 1 ? "touch" : "touches"}`);
  }

  private key(event: KeyboardEvent): void {
    const by = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
    if (event.key === "Escape") this.live();
    else if (event.key === "Delete") void this.forget().catch(() => undefined);
    else if (by) {
      const numbers = [...this.records.keys()].sort((a, b) => a - b);
      const at = this.chosen === null ? numbers.length - 1 : numbers.indexOf(this.chosen);
      const number = numbers[Math.max(0, Math.min(numbers.length - 1, at + by))];
      if (number === undefined) return;
      this.choose(number, false);
      this.buttons.get(number)!.focus();
    } else return;
    event.preventDefault();
  }

  private async rename(name: string): Promise<void> {
    if (this.chosen === null) return;
    this.put(await post<TouchRecord>(`touches/${this.chosen}`, { name }));
  }

  private async forget(): Promise<void> {
    if (this.chosen === null) return;
    await remove(`touches/${this.chosen}`);
    this.drop(this.chosen);
    this.live();
  }
}

/** How two touches differ, in words. */
function compared(a: TouchRecord, b: TouchRecord): string {
  const one = a.answer, other = b.answer;
  if (!one?.object || !other?.object) return `touches ${a.number} and ${b.number}: one of them has no answer`;
  if (one.object !== other.object || one.face !== other.face || !one.place || !other.place) {
    return `${one.object} ${one.face} and ${other.object} ${other.face}`;
  }
  const [p, q] = [one.place, other.place];
  const turn = ((q.theta_deg - p.theta_deg + 540) % 360) - 180;
  return `${one.object} ${one.face}: ${(q.x_mm - p.x_mm).toFixed(2)}, ${(q.y_mm - p.y_mm).toFixed(2)} mm and ${turn.toFixed(2)}° from ${a.number} to ${b.number}`;
}
