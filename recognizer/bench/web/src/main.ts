/** The page: what comes in goes to the panels, what is clicked goes to the server. */

import { get, post } from "./api";
import { AnswerPanel } from "./answer";
import { type Bench, MountingCheck, PrintCheck } from "./checks";
import { setClock, since as sinceServer } from "./clock";
import { choices, element, isDark, say } from "./dom";
import { Gallery } from "./gallery";
import { GuideDialog } from "./guide";
import { Heat } from "./heat";
import { Live } from "./live";
import { MapPanel } from "./map";
import { MosaicPanel } from "./mosaic";
import { Panes } from "./panes";
import { Part, type Place } from "./part";
import { Replay } from "./replay";
import { ScanPanel } from "./scan";
import { Surface } from "./surface";
import { Tint } from "./tint";
import { Tour } from "./tour";
import { Touches } from "./touches";
import type { ArrayMap, BenchInfo, Encoding, Frame, ObjectEntry, ObjectShape, ReaderState, Told, TouchRecord } from "./types";
import { Work } from "./work";

/** What tests and measurements ask for. */
interface Figures { frames: number; paints: number; latency_ms: number[]; answers: number; click_ms: number[]; lit: string; shown: string; contact: boolean; touch: number; state: string }
const figures: Figures = { frames: 0, paints: 0, latency_ms: [], answers: 0, click_ms: [], lit: "", shown: "", contact: false, touch: 0, state: "" };
Object.assign(window, { bench: figures });
const KEPT = 5000;

async function begin(): Promise<void> {
  const info = await get<BenchInfo>("bench");
  const { sensor } = info;
  const heat = new Heat(sensor), surface = new Surface(sensor), mosaic = new MosaicPanel(sensor);
  const answers = new AnswerPanel(info.margin), work = new Work(info), guide = new GuideDialog(), replay = new Replay();
  const part = new Part(sensor, (place) => void touch(place).catch(() => undefined));
  new Gallery((name) => look(name), () => figures.shown);
  const map = new MapPanel((name) => look(name));
  const touches = new Touches((one, past) => void take(one, past));
  const tint = new Tint(part, sensor, () => touches.all);
  const scan = new ScanPanel(), bench: Bench = { shape: () => part.shape, touches: () => touches.all, press };
  const mounting = new MountingCheck(bench), prints = new PrintCheck(bench);
  new Tour();
  new Panes();
  let newest: Frame | null = null, painting = false, simulated = false, past = false, asked = "";
  let record: TouchRecord | null = null, clicked: number | null = null, painted = 0, read = 0, started = 0, ready = false;

  const line = new Live({
    frame(frame) {
      figures.frames++;
      if (past || element<HTMLInputElement>("freeze").checked) return;
      newest = frame;
      if (!painting) {
        painting = true;
        requestAnimationFrame(paint);
      }
    },
    mosaic: (image) => {
      mosaic.show(image);
      tint.touched();
    },
    told,
    connected: (there) => {
      for (const id of ["touch", "work-body"]) element(id).inert = !there;
      document.body.dataset["line"] = there ? "there" : "gone";
      if (there) void setClock().catch(() => undefined);
      if (there) void touches.load().then(() => { ready = true; }).catch(() => undefined);
      else work.gone();
    },
  }, "bias-free");

  function paint(): void {
    painting = false;
    if (!newest) return;
    heat.paint(newest);
    surface.paint(newest, heat.top);
    figures.paints++;
    keep(figures.latency_ms, sinceServer(newest.received_ms));
    if (performance.now() - painted > 1000) {
      painted = performance.now();
      const last = figures.latency_ms.slice(-60).sort((a, b) => a - b);
      say(element("latency"), `${(last[last.length >> 1] ?? 0).toFixed(0)} ms`);
    }
  }

  function told(topic: Told): void {
    if (topic.topic === "status") {
      if (started && topic.started_ms !== started) location.reload(); // its touches are numbered anew
      started = topic.started_ms;
      simulated = topic.simulated;
      work.tell(topic);
      work.learnable(touches.all.filter((one) => one.answer).length);
      guide.tell(topic);
      mounting.status(topic);
      prints.status(topic);
      replay.tell(topic);
      element("touch").querySelector("button")!.disabled = !simulated;
      element("next-go").hidden = !simulated;
    } else if (topic.topic === "touch") {
      touches.tell(topic);
      mounting.tell(topic);
      prints.tell();
    } else if (topic.topic === "scan") scan.tell(topic);
    else if (topic.topic === "touches") void touches.load().then(() => tint.touched()).catch(() => undefined);
    else if (topic.topic === "mosaic-of") mosaic.told(topic);
    else void reader(topic).catch(() => undefined);
  }

  /** Show one record in all panels; null: nothing was touched yet. */
  function take(one: TouchRecord | null, ofPast: boolean): void {
    record = one;
    past = ofPast;
    const answer = one?.answer ?? null;
    if (!ready) read = Math.max(read, answer?.read ?? 0); // it was there before the page
    const fresh = answer !== null && !past && answer.read > read;
    let since: number | null = null;
    if (fresh) {
      read = answer.read;
      figures.answers++;
      since = clicked === null ? null : performance.now() - clicked;
      clicked = null;
      tint.touched();
      if (since !== null) requestAnimationFrame(() => keep(figures.click_ms, since!));
    }
    figures.contact = !past && (one?.contact ?? false);
    figures.touch = one?.number ?? 0;
    figures.state = one?.state ?? "";
    answers.tell(one, since, past);
    heat.answer = past || (one?.contact && !one.moving) ? answer : null;
    map.tell(answer);
    if (past) void image(one!.number).catch(() => undefined);
    if (answer?.object && (fresh || past) && answer.object !== part.shape?.name && element<HTMLInputElement>("follow").checked) look(answer.object);
    else lights();
  }

  /** Paint the image of a touch of the past. */
  async function image(number: number): Promise<void> {
    const { counts } = await get<{ counts: number[][] }>(`touches/${number}`);
    if (!past || record?.number !== number) return;
    const values = Float32Array.from(counts.flat()), low = Math.min(...values);
    values.forEach((value, i) => { values[i] = value - low; });
    const largest = Math.max(...values);
    const frame: Frame = { newtons: false, filter: 0, seq: 0, time_s: record.time_s, received_ms: record.felt_ms, largest, sum: 0, values };
    heat.top = 0;
    heat.paint(frame);
    surface.paint(frame, heat.top);
  }

  function lights(): void {
    const answer = record?.answer ?? null;
    part.tell(answer, past || (record?.contact ?? false));
    if (answer?.T_object_probe && answer.object === part.shape?.name && element<HTMLInputElement>("follow").checked) part.face(answer.T_object_probe);
    mosaic.tell(answer, part.shape);
    figures.lit = part.litFace;
    element("part").dataset["lit"] = figures.lit;
  }

  async function touch(place: Place): Promise<void> {
    element<HTMLSelectElement>("touch-face").value = place.face;
    for (const [id, value] of [["touch-x", place.x_mm], ["touch-y", place.y_mm]] as const) element<HTMLInputElement>(id).value = value.toFixed(1);
    const number = (id: string): number => Number(element<HTMLInputElement>(id).value);
    await press(place.face, place.x_mm, place.y_mm, number("touch-theta"), number("touch-force"));
  }

  /** Let the simulated probe come down on the object that is shown. */
  async function press(face: string, x_mm: number, y_mm: number, theta_deg: number, force_n: number): Promise<void> {
    touches.live();
    clicked = performance.now();
    await post("touch", { object: part.shape?.name ?? "", face, x_mm, y_mm, theta_deg, force_n });
  }

  function look(name: string): void {
    void show(name).catch(() => undefined); // why not was told
  }

  /** Show an object; the last one asked for wins, and one shown again keeps the form as it was filled in. */
  async function show(name: string): Promise<void> {
    asked = name;
    const shape = await get<ObjectShape>(`objects/${encodeURIComponent(name)}`).catch((error: unknown) => {
      if (asked === name) element<HTMLSelectElement>("object").value = figures.shown;
      throw error;
    });
    if (asked !== name) return;
    const again = figures.shown === name, face = element<HTMLSelectElement>("touch-face").value;
    part.show(shape);
    tint.show(shape);
    figures.shown = name;
    element<HTMLSelectElement>("object").value = name;
    choices(element("touch-face"), shape.faces.filter((one) => !one.blank).map((one) => [one.name, one.name]));
    if (!again || element<HTMLSelectElement>("touch-face").value !== face) middle(shape);
    element("files").replaceChildren(...shape.parts.map((one) => {
      const item = document.createElement("li"), link = document.createElement("a");
      link.href = `/api/objects/${encodeURIComponent(name)}/parts/${one.number}`;
      link.download = "";
      link.textContent = `${one.name} (${one.format})`;
      item.append(link);
      return item;
    }));
    lights();
  }

  /** Put the middle of the chosen face in the form. */
  function middle(shape: ObjectShape | null): void {
    const face = shape?.faces.find((one) => one.name === element<HTMLSelectElement>("touch-face").value);
    if (!face?.centres.length) return;
    const mean = (k: 0 | 1): string => (face.centres.reduce((sum, c) => sum + c[k], 0) / face.centres.length).toFixed(1);
    element<HTMLInputElement>("touch-x").value = mean(0);
    element<HTMLInputElement>("touch-y").value = mean(1);
  }

  async function reader(state: ReaderState): Promise<void> {
    const texts = { preparing: "reading the database…", ready: "", off: `${state.cause ?? ""}: ${state.fix ?? ""}` };
    say(element("reader"), texts[state.state]);
    if (state.state === "off") await empty();
    if (state.state !== "ready") return;
    const { encodings } = await get<{ encodings: Encoding[] }>("lab");
    heat.encodings = encodings;
    element("encoding-label").hidden = encodings.length < 2;
    choices(element("encoding"), encodings.map((one, i) => [String(i), `${one.rows} × ${one.columns}, ${one.alphabet}`]));
    if (encodings.length) await array(0);
    await objects();
  }

  /** Offer an example where nothing is registered. */
  async function empty(): Promise<void> {
    const { objects: held } = await get<{ objects: ObjectEntry[] }>("objects");
    element("empty").hidden = held.length > 0;
  }

  /** Make the example, and touch the middle of its first face. */
  async function example(): Promise<void> {
    const button = element<HTMLButtonElement>("example");
    button.disabled = true;
    say(button, "Making it…");
    try {
      const { object } = await post<{ object: string }>("example");
      await show(object);
      await touch({ face: element<HTMLSelectElement>("touch-face").value, x_mm: Number(element<HTMLInputElement>("touch-x").value), y_mm: Number(element<HTMLInputElement>("touch-y").value) });
    } finally {
      button.disabled = false;
      say(button, "Make an example and touch it");
    }
  }

  async function array(number: number): Promise<void> {
    map.show(await get<ArrayMap>(`map/${number}`), number);
  }

  async function objects(): Promise<void> {
    const { objects: held } = await get<{ objects: ObjectEntry[] }>("objects");
    choices(element("object"), held.map((one) => [one.name, `${one.name}${one.retired ? " (retired)" : ""}`]));
    element("empty").hidden = held.length > 0;
    const first = part.shape?.name ?? held[0]?.name;
    if (first) await show(first);
  }

  function themes(): void {
    for (const panel of [part, surface, map, mosaic, replay]) panel.theme();
  }

  const filter = element<HTMLSelectElement>("filter");
  choices(filter, info.filters.map((name) => [name, name === "sobel" ? "Sobel" : name]), "bias-free");
  filter.addEventListener("change", () => { heat.top = 0; line.choose(filter.value); });
  element("show-symbols").addEventListener("change", (event) => { heat.symbols = (event.target as HTMLInputElement).checked; });
  element("show-probe").addEventListener("change", (event) => part.withProbe((event.target as HTMLInputElement).checked));
  element("object").addEventListener("change", (event) => look((event.target as HTMLSelectElement).value));
  element("encoding").addEventListener("change", (event) => void array(Number((event.target as HTMLSelectElement).value)).catch(() => undefined));
  element("touch-face").addEventListener("change", () => middle(part.shape));
  element("touch").addEventListener("submit", (event) => {
    event.preventDefault();
    const number = (id: string): number => Number(element<HTMLInputElement>(id).value);
    void touch({ face: element<HTMLSelectElement>("touch-face").value, x_mm: number("touch-x"), y_mm: number("touch-y") }).catch(() => undefined);
  });
  element("example").addEventListener("click", () => void example().catch(() => undefined));
  element("next-go").addEventListener("click", () => {
    clicked = performance.now();
    void post("touch/next").catch(() => undefined);
  });
  element("mosaic-clear").addEventListener("click", () => void post("mosaic").catch(() => undefined));
  element("save-picture").addEventListener("click", () => picture());
  element("theme").addEventListener("click", () => {
    const root = document.documentElement;
    root.dataset["theme"] = isDark() ? "light" : "dark";
    localStorage.setItem("theme", root.dataset["theme"]);
    themes();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", themes);
  themes();
}

function picture(): void {
  element<HTMLCanvasElement>("heat").toBlob((blob) => {
    if (!blob) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = "touch.png";
    link.click();
    URL.revokeObjectURL(link.href);
  });
}

function keep(list: number[], value: number): void {
  list.push(value);
  if (list.length > KEPT) list.splice(0, KEPT / 2);
}

const chosen = localStorage.getItem("theme");
if (chosen) document.documentElement.dataset["theme"] = chosen;
void begin();
