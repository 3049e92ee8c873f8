/** The page: what comes in goes to the panels, what is clicked goes to the server. */

import { get, post } from "./api";
import { AnswerPanel } from "./answer";
import { type Bench, MountingCheck, PrintCheck } from "./checks";
import { setClock, since as sinceServer } from "./clock";
import { able, choices, clearError, element, isDark, say } from "./dom";
import { figures, keep } from "./figures";
import { GuideDialog } from "./guide";
import { Heat } from "./heat";
import { Live } from "./live";
import { MakeDialog } from "./make";
import { MosaicPanel } from "./mosaic";
import { Objects } from "./objects";
import { Panes } from "./panes";
import { Part } from "./part";
import { PressForm } from "./press";
import { Replay } from "./replay";
import { ScanPanel } from "./scan";
import { Surface } from "./surface";
import { Tint } from "./tint";
import { Tour } from "./tour";
import { Touches } from "./touches";
import type { BenchInfo, Frame, Told, TouchRecord } from "./types";
import { Work } from "./work";

const FILTERS: Record<string, string> = { "bias-free": "without bias", sobel: "edges (Sobel)" };

async function begin(): Promise<void> {
  const info = await get<BenchInfo>("bench");
  const { sensor } = info;
  const heat = new Heat(sensor), surface = new Surface(sensor), mosaic = new MosaicPanel(sensor);
  const answers = new AnswerPanel(info.margin), work = new Work(info), guide = new GuideDialog(), replay = new Replay();
  const touches = new Touches((one, past) => void take(one, past)), form = new PressForm(sensor.force_n, () => touches.live());
  const part = new Part(sensor, (place) => void form.touch(place).catch(() => undefined));
  const tint = new Tint(part, sensor, () => touches.all);
  const objects = new Objects(heat, form, (shape) => {
    part.show(shape);
    tint.show(shape);
    lights();
  });
  const making = new MakeDialog(sensor, (name) => objects.look(name));
  const bench: Bench = { shape: () => part.shape, touches: () => touches.all, press: (...where) => form.press(...where) };
  const scan = new ScanPanel(), mounting = new MountingCheck(bench), prints = new PrintCheck(bench);
  new Tour();
  new Panes();
  let newest: Frame | null = null, painting = false, past = false;
  let held = false, released = 0; // the image of a lifted touch stays until the next one, or until another unit or filter is chosen
  let strongest: { touch: number; frame: Frame } | null = null; // of the touch that is felt
  let record: TouchRecord | null = null, painted = 0, read = 0, started = 0, ready = false;

  const line = new Live({
    frame(frame) {
      figures.frames++;
      if (held && (frame.newtons !== newest?.newtons || frame.filter !== newest.filter)) [held, released] = [false, record?.number ?? 0];
      if (past || held || element<HTMLInputElement>("freeze").checked) return;
      newest = frame;
      if (record?.contact && !(strongest?.touch === record.number && strongest.frame.largest > frame.largest)) strongest = { touch: record.number, frame };
      repaint();
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

  function repaint(): void {
    if (!painting) requestAnimationFrame(paint);
    painting = true;
  }

  function paint(): void {
    painting = false;
    if (!newest) return;
    heat.paint(newest);
    surface.paint(newest, heat.top);
    if (!figures.paints++) for (const id of ["save-picture", "save-frame"]) able(id, true);
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
      form.simulated(topic.simulated);
      answers.simulated = topic.simulated;
      work.tell(topic);
      work.learnable(touches.all.filter((one) => one.answer).length);
      guide.tell(topic);
      mounting.status(topic);
      prints.status(topic);
      replay.tell(topic);
    } else if (topic.topic === "touch") {
      touches.tell(topic);
      mounting.tell(topic);
      prints.tell();
    } else if (topic.topic === "scan") scan.tell(topic);
    else if (topic.topic === "touches") void touches.load().then(() => tint.touched()).catch(() => undefined);
    else if (topic.topic === "mosaic-of") mosaic.told(topic);
    else void objects.reader(topic).catch(() => undefined);
  }

  /** Show one record in all panels; null: nothing was touched yet. */
  function take(one: TouchRecord | null, ofPast: boolean): void {
    record = one;
    past = ofPast;
    const answer = one?.answer ?? null, lifted = !past && answer !== null && !one!.contact && one!.number !== released && one!.number === strongest?.touch;
    if (!ready) read = Math.max(read, answer?.read ?? 0); // it was there before the page
    const fresh = answer !== null && !past && answer.read > read;
    let since: number | null = null;
    if (fresh) {
      read = answer.read;
      figures.answers++;
      clearError();
      since = form.since();
      tint.touched();
      if (since !== null) requestAnimationFrame(() => keep(figures.click_ms, since!));
    }
    figures.contact = !past && (one?.contact ?? false);
    figures.touch = one?.number ?? 0;
    figures.state = one?.state ?? "";
    answers.tell(one, since, past);
    heat.answer = past || lifted || (one?.contact && !one.moving) ? answer : null;
    objects.map.tell(answer);
    if (past) void image(one!.number).catch(() => undefined);
    if (lifted && !held) {
      newest = strongest!.frame;
      repaint();
    }
    held = lifted;
    if (answer?.object && (fresh || past) && answer.object !== part.shape?.name && element<HTMLInputElement>("follow").checked) objects.look(answer.object);
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

  function themes(): void {
    for (const panel of [part, making, surface, objects.map, mosaic, replay]) panel.theme();
  }

  const filter = element<HTMLSelectElement>("filter");
  choices(filter, info.filters.map((name) => [name, FILTERS[name] ?? name]), "bias-free");
  filter.addEventListener("change", () => { heat.top = 0; line.choose(filter.value); });
  element("show-symbols").addEventListener("change", (event) => { heat.symbols = (event.target as HTMLInputElement).checked; });
  element("show-probe").addEventListener("change", (event) => part.withProbe((event.target as HTMLInputElement).checked));
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

const chosen = localStorage.getItem("theme");
if (chosen) document.documentElement.dataset["theme"] = chosen;
void begin();
