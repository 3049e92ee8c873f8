/** What the database holds: its objects, their files, its arrays; an example where it holds none. */

import { get, post } from "./api";
import { able, choices, element, say } from "./dom";
import { figures } from "./figures";
import { Gallery } from "./gallery";
import type { Heat } from "./heat";
import { MapPanel } from "./map";
import type { PressForm } from "./press";
import type { ArrayMap, Encoding, ObjectEntry, ObjectShape, ReaderState } from "./types";

export class Objects {
  readonly map = new MapPanel((name) => this.look(name));
  private readonly list = element<HTMLSelectElement>("object");
  private readonly encoding = element<HTMLSelectElement>("encoding");
  private asked = "";

  constructor(private readonly heat: Heat, private readonly form: PressForm, private readonly shown: (shape: ObjectShape) => void) {
    new Gallery((name) => this.look(name), () => figures.shown);
    this.list.addEventListener("change", () => this.look(this.list.value));
    this.encoding.addEventListener("change", () => void this.array(Number(this.encoding.value)).catch(() => undefined));
    element("example").addEventListener("click", () => void this.example().catch(() => undefined));
  }

  look(name: string): void {
    void this.show(name).catch(() => undefined); // why not was told
  }

  async reader(state: ReaderState): Promise<void> {
    const texts = { preparing: "reading the database…", ready: "", off: `${state.cause ?? ""}: ${state.fix ?? ""}` };
    say(element("reader"), texts[state.state]);
    able("scan", state.state === "ready");
    if (state.state === "off") await this.held();
    if (state.state !== "ready") return;
    const { encodings } = await get<{ encodings: Encoding[] }>("lab");
    this.heat.encodings = encodings;
    element("encoding-label").hidden = encodings.length < 2;
    choices(this.encoding, encodings.map((one, i) => [String(i), `${one.rows} × ${one.columns}, ${one.alphabet}`]));
    if (encodings.length) await this.array(0);
    const held = await this.held();
    choices(this.list, held.map((one) => [one.name, `${one.name}${one.retired ? " (retired)" : ""}`]));
    const first = this.asked || held[0]?.name;
    if (first) await this.show(first);
  }

  /** Show an object; the last one asked for wins. */
  private async show(name: string): Promise<void> {
    this.asked = name;
    const shape = await get<ObjectShape>(`objects/${encodeURIComponent(name)}`).catch((error: unknown) => {
      if (this.asked === name) this.asked = this.list.value = figures.shown;
      throw error;
    });
    if (this.asked !== name) return;
    figures.shown = name;
    this.list.value = name;
    this.form.show(shape);
    element("files").replaceChildren(...shape.parts.map((one) => {
      const item = document.createElement("li"), link = document.createElement("a");
      link.href = `/api/objects/${encodeURIComponent(name)}/parts/${one.number}`;
      link.download = "";
      link.textContent = `${one.name} (${one.format})`;
      item.append(link);
      return item;
    }));
    this.shown(shape);
  }

  /** What is registered; where nothing is, an example is offered. */
  private async held(): Promise<ObjectEntry[]> {
    const { objects } = await get<{ objects: ObjectEntry[] }>("objects");
    element("empty").hidden = objects.length > 0;
    able("gallery-open", objects.length > 0);
    return objects;
  }

  /** Make the example, and touch the middle of its first face. */
  private async example(): Promise<void> {
    const button = element<HTMLButtonElement>("example");
    button.disabled = true;
    say(button, "Making it…");
    try {
      const { object } = await post<{ object: string }>("example");
      await this.show(object);
      await this.form.touch(this.form.place());
    } finally {
      button.disabled = false;
      say(button, "Make an example and touch it");
    }
  }

  private async array(number: number): Promise<void> {
    for (const id of ["map-all", "map-window"]) able(id, true);
    this.map.show(await get<ArrayMap>(`map/${number}`), number);
  }
}
