/** Make a part: a form, what it would be while one fills it in, and a zip of all files. */

import { get, silence } from "./api";
import { gradient } from "./colours";
import { element, say, showError } from "./dom";
import { figures } from "./figures";
import { type Settings, SpecForm } from "./form";
import { Part } from "./part";
import { faceRows, shade, words } from "./tint";
import type { ObjectShape, Promised, Sensor } from "./types";

interface Problem { line?: number | null; place: string; cause: string; fix: string }
interface Face { name: string; place: string; symbols: number; promise: (Promised & { remedy: string; meets: string[] }) | null }
interface Made { objects: { faces: number; symbols: number; parts: number; promise: string[]; warnings: string[]; face_reports: Face[] }[] }

interface Refusal { error?: Problem & { problems?: Problem[] } }

const PAUSE_MS = 250; // without a change, after which it is tried

export class MakeDialog {
  private readonly dialog = element<HTMLDialogElement>("make");
  private readonly lab = element<HTMLSelectElement>("make-lab");
  private readonly go = element<HTMLButtonElement>("make-go");
  private form: SpecForm | null = null;
  private part: Part | null = null;
  private waiting = 0;
  private trying: AbortController | null = null;
  private making: AbortController | null = null;

  constructor(private readonly sensor: Sensor, private readonly made: (object: string) => void) {
    for (const id of ["make-open", "make-first"]) {
      const open = element<HTMLButtonElement>(id);
      open.addEventListener("click", () => void this.open().catch(() => undefined));
      open.disabled = false; // until now a click would have been lost
    }
    this.go.addEventListener("click", () => (this.making ? this.making.abort() : void this.make()));
    this.lab.addEventListener("change", () => this.change());
    element("make-save").addEventListener("click", () => save(new Blob([element("make-spec").textContent ?? ""]), `${this.form?.name || "part"}.yaml`));
    element("make-link").addEventListener("click", () => void navigator.clipboard.writeText(location.href).then(
      () => say(element("make-state"), "the link is copied"), () => say(element("make-state"), "the link is this page's address")));
    this.dialog.addEventListener("close", () => {
      this.trying?.abort();
      history.replaceState(null, "", location.pathname);
    });
    element("make-scale").style.background = gradient();
    addEventListener("hashchange", () => this.follow());
    this.follow();
  }

  theme(): void { this.part?.theme(); }

  /** Open with what the page's address says. */
  private follow(): void {
    if (location.hash.startsWith("#make")) void this.open(new URLSearchParams(location.hash.split("?")[1])).catch(() => undefined);
  }

  private async open(link?: URLSearchParams): Promise<void> {
    if (!this.dialog.open) this.dialog.showModal();
    const settings = await get<Settings>("make");
    this.lab.replaceChildren(new Option(`${settings.lab}${settings.new ? " (new)" : ""}`, "lab"), new Option("a lab of its own, in the zip", ""));
    this.lab.value = settings.new ? "" : "lab";
    this.part ??= new Part(this.sensor, null, element<HTMLCanvasElement>("make-part"));
    const first = !this.form;
    this.form ??= new SpecForm(element("make-form"), settings, () => this.change());
    if (link || first) {
      const unknown = this.form.fill(link ?? new URLSearchParams());
      if (unknown.length) showError(`The link names settings or values that are not offered here: ${unknown.join(", ")}.`);
    }
    this.change(0);
  }

  /** Something was changed: keep it in the address, and try it once that has come to rest. */
  private change(pause_ms = PAUSE_MS): void {
    const { form } = this;
    if (!form) return;
    say(element("make-spec"), form.spec().text);
    history.replaceState(null, "", form.link);
    this.trying?.abort();
    this.dialog.setAttribute("aria-busy", "true");
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => void this.attempt(form), pause_ms);
  }

  private async attempt(form: SpecForm): Promise<void> {
    const trying = new AbortController(), began = performance.now();
    this.trying = trying;
    const answer = await this.ask("make/try", trying.signal);
    if (trying.signal.aborted) return;
    this.dialog.removeAttribute("aria-busy");
    if (!answer?.ok) return answer ? this.refused(form, await refusal(answer)) : undefined;
    const { made, shape } = await answer.json() as { made: Made; shape: ObjectShape | null };
    this.refused(form, {});
    this.show(made, shape);
    figures.tried_ms = performance.now() - began;
    figures.tried++;
  }

  /** Say what is refused, at its field; nothing is where nothing is refused. */
  private refused(form: SpecForm, { error }: Refusal): void {
    const { paths } = form.spec(), problems = error ? (error.problems?.length ? error.problems : [error]) : [];
    form.mark(problems.flatMap(({ line }) => (line ? paths[line - 1] ?? [] : [])));
    this.go.disabled = !this.making && problems.length > 0;
    this.dialog.dataset["state"] = problems.length ? "refused" : "sound";
    element("make-problems").replaceChildren(...problems.map(({ line, cause, fix }) => {
      const item = document.createElement("p"), more = document.createElement("span");
      item.textContent = `${line ? `line ${line}: ` : ""}${cause}`;
      more.className = "muted";
      more.textContent = ` ${fix}`;
      item.append(more);
      return item;
    }));
  }

  private show(made: Made, shape: ObjectShape | null): void {
    const one = made.objects[0]!, count = made.objects.length;
    const colours = new Map(one.face_reports.flatMap(({ name, promise }) => (promise ? [[name, shade(promise.at_once)]] : []) as [string, string][]));
    element("make-part").hidden = !shape;
    if (shape) this.part?.show(shape, true);
    this.part?.tint(colours, new Map(), false);
    const heads = [...one.promise, `${count > 1 ? `${count} alike, each ` : ""}${one.faces} faces, ${one.symbols.toLocaleString("en")} symbols, ${one.parts} ${one.parts === 1 ? "part" : "parts"} to print`, ...(shape ? [] : ["it has too many symbols to be drawn"]), ...one.warnings];
    element("make-told").replaceChildren(...heads.map((text) => Object.assign(document.createElement("p"), { textContent: text })));
    faceRows(element("make-faces"), one.face_reports.map(({ name, place, symbols, promise }) => [
      name, `${place}, ${symbols} symbols; ${promise ? words(promise) : "nothing is promised of single touches"}${promise?.meets.length ? `; the sensor meets ${promise.meets.join(", ")}` : ""}${promise?.remedy ? `; would help: ${promise.remedy}` : ""}`,
      colours.get(name) ?? "",
    ]));
  }

  private async make(): Promise<void> {
    const making = new AbortController(), began = performance.now();
    this.making = making;
    const state = element("make-state"), clock = setInterval(() => say(state, `making it… ${Math.round((performance.now() - began) / 1e3)} s`), 500);
    say(this.go, "Cancel");
    try {
      const answer = await this.ask("make", making.signal);
      if (making.signal.aborted || !answer) return say(state, making.signal.aborted ? "given up" : "");
      if (!answer.ok) {
        say(state, "");
        return this.refused(this.form!, await refusal(answer));
      }
      const kept = this.lab.value !== "", name = answer.headers.get("content-disposition")?.split('"')[1] ?? "part.zip";
      save(await answer.blob(), name);
      say(state, `${name} is made: begin with the build sheet (-build.html) in it; ${kept ? `registered in ${this.lab.selectedOptions[0]!.text}` : "touches are read with the lab.db in it"}`);
      if (kept) this.made(decodeURIComponent(answer.headers.get("x-object") ?? ""));
      figures.made++;
    } finally {
      clearInterval(clock);
      this.making = null;
      say(this.go, "Make and download");
    }
  }

  /** Send the form; nothing where the server is not reached. */
  private async ask(path: string, signal: AbortSignal): Promise<Response | null> {
    const body = JSON.stringify({ name: this.form!.name.slice(0, 200), spec: this.form!.spec().text, keep: this.lab.value !== "" });
    try {
      return await fetch(`/api/${path}`, { method: "POST", headers: { "content-type": "application/json" }, body, signal });
    } catch {
      if (!signal.aborted) showError(`Nothing was made: ${silence()}.`);
      return null;
    }
  }
}

async function refusal(answer: Response): Promise<Refusal> {
  return await answer.json().catch(() => ({ error: { cause: `the server fails (${answer.status})`, fix: "try again", place: "" } })) as Refusal;
}

function save(content: Blob, name: string): void {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(content), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
