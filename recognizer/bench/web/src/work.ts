/** Port, sensor, recording, bias, calibration in use; the probe's state and what happened. */

import { get, post, send, silence } from "./api";
import { timeOf } from "./clock";
import { choices, element, say, showError } from "./dom";
import type { BenchInfo, Status } from "./types";

export class Work {
  private status: Status | null = null;
  private shown = 0;
  private newest: string | undefined; // recording
  private probe = ""; // the port that was read last, recordings apart

  constructor(private info: BenchInfo) {
    const on = (id: string, event: string, act: () => Promise<unknown>): void =>
      element(id).addEventListener(event, () => void act().catch(() => undefined));
    const value = (id: string): string => element<HTMLSelectElement>(id).value;
    on("port", "change", () => post("port", { url: value("port") }));
    on("port", "focus", () => this.ports());
    on("sensor", "change", () => post("sensor", { sensor: Number(value("sensor")) }));
    on("record", "click", () => post("record", { on: !this.status?.recording }));
    on("bias", "click", () => post("bias", { on: this.status?.bias === "none" }));
    on("unplug", "click", () => post("unplug", { seconds: 2 }));
    on("replay", "click", () => post("replay", { name: value("recordings") }));
    on("leave", "click", () => post("port", { url: this.probe }));
    on("calibrations", "change", () => post("calibration", { do: "use", name: value("calibrations") }));
    on("reload", "click", () => post("lab"));
    on("upload", "change", () => this.upload());
    on("flip", "change", () => post("flip", { changes: value("flip") }));
    on("states", "change", () => post("learned", { do: "use", name: value("states") }));
    on("learn", "click", () => post("learned", { do: "learn" }));
    choices(element("port"), this.options());
  }

  tell(status: Status): void {
    this.status = status;
    const { feed } = status, live = feed.state === "live";
    this.state(status);
    const probes = this.info.ports.map((one) => one.url).filter((url) => !url.startsWith("file:"));
    if (probes.includes(status.port)) this.probe = status.port;
    else if (!this.probe) this.probe = probes[0] ?? "";
    say(element("rate"), live ? `${feed.rate?.toFixed(0)} Hz` : "–");
    say(element("lost"), feed.lost === undefined ? "–" : String(feed.lost + (feed.late ?? 0)));
    say(element("damaged"), feed.damaged === undefined ? "–" : String(feed.damaged));
    const known = status.calibration;
    say(element("calibration-age"), known ? known.age + (known.bad ? `, ${known.bad} bad` : "") : "none");
    element("calibration-age").title = known ? `${known.name}, ${known.made} ${known.warning}` : "readings are counts";
    choices(element("port"), this.options(), this.info.ports.some((one) => one.url === status.port) ? status.port : "");
    if (feed.sensor !== null && feed.sensor !== undefined) choices(element("sensor"), SENSORS, String(feed.sensor));
    element<HTMLSelectElement>("sensor").disabled = !live;
    choices(element("recordings"), status.recordings.length ? status.recordings.map(twice) : [["", "none yet"]]);
    if (status.recordings[0] !== this.newest) {
      this.newest = status.recordings[0];
      element<HTMLSelectElement>("recordings").value = this.newest ?? "";
    }
    choices(element("calibrations"), [["", "none: counts"], ...status.calibrations.map(twice)], known?.name ?? "");
    const record = element<HTMLButtonElement>("record");
    record.disabled = !live && !status.recording;
    record.setAttribute("aria-pressed", String(status.recording !== null));
    say(record, status.recording ? `Stop (${status.recording.frames.toLocaleString("en")})` : "Record");
    const bias = element<HTMLButtonElement>("bias");
    bias.disabled = !live;
    bias.setAttribute("aria-pressed", String(status.bias !== "none"));
    say(bias, { none: "Take bias", taking: "Taking bias…", taken: "Bias off" }[status.bias]);
    element("unplug").hidden = !status.simulated;
    element<HTMLButtonElement>("replay").disabled = !status.recordings.length;
    choices(element("flip"), FLIPS.some(([changes]) => changes === status.flip) ? FLIPS : [...FLIPS, twice(status.flip)], status.flip);
    choices(element("states"), [["", "nothing: by its type"], ...status.states.map(twice)], status.learned?.name ?? "");
    element("states").title = status.learned?.words ?? "";
    this.notices(status);
  }

  /** Say whether the sensor can be learned from the touches that were read. */
  learnable(touches: number): void {
    if (!this.status) return;
    const { learning, least } = this.status, button = element<HTMLButtonElement>("learn");
    button.disabled = learning !== null || touches < least;
    say(button, learning !== null ? `Learning ${(100 * learning).toFixed(0)} %` : touches < least ? `Learn (${touches} of ${least} touches)` : `Learn from ${touches} touches`);
  }

  /** What the server says when it cannot be reached. */
  gone(): void {
    const state = element("state");
    state.dataset["state"] = "server-gone";
    say(state, `${silence()}; it is looked for. What is shown is what was there before`);
  }

  private state(status: Status): void {
    const { feed } = status, state = element("state");
    state.dataset["state"] = feed.state;
    const device = feed.device ? `${feed.device}${feed.sensor === null || feed.sensor === undefined ? "" : `, sensor ${feed.sensor}`}` : "";
    const texts = {
      none: "no probe is connected", waiting: "looking for the probe", live: `probe is there: ${device || status.port}`,
      gone: `probe is gone: ${feed.cause ?? ""}`, replay: "replaying a recording",
    };
    say(state, texts[feed.state]);
    state.title = feed.fix ?? "";
  }

  private notices(status: Status): void {
    const list = element("notices");
    for (const { number, at_ms, text } of status.notices) {
      if (number <= this.shown) continue;
      this.shown = number;
      const item = document.createElement("p");
      item.textContent = `${timeOf(at_ms)}  ${text}`;
      list.prepend(item);
      while (list.children.length > 60) list.lastElementChild?.remove();
    }
  }

  private options(): [string, string][] {
    return [...this.info.ports.map((one): [string, string] => [one.url, one.label]), ["", "none"]];
  }

  private async ports(): Promise<void> {
    this.info = await get<BenchInfo>("bench");
    choices(element("port"), this.options());
  }

  private async upload(): Promise<void> {
    const input = element<HTMLInputElement>("upload"), file = input.files?.[0];
    input.value = "";
    if (!file) return;
    const bar = element<HTMLProgressElement>("upload-share"), told = (share: number): void => {
      bar.hidden = false;
      bar.value = share;
    };
    if (file.size > 64 * 2 ** 20) showError("Recordings of at most 64 MB can be sent in.");
    else await send(`recordings?name=${encodeURIComponent(file.name)}`, file, told).finally(() => { bar.hidden = true; });
  }
}

const SENSORS = Array.from({ length: 8 }, (_, i): [string, string] => [String(i), String(i)]);

const FLIPS: [string, string][] = [
  ["", "as they come"], ["columns", "columns reversed"], ["rows", "rows reversed"], ["quarter,quarter", "half a turn"],
  ["quarter", "a quarter turn left"], ["quarter,quarter,quarter", "a quarter turn right"], ["transpose", "transposed"],
  ["column-halves", "column halves swapped"], ["row-halves", "row halves swapped"], ["values", "falling with force"],
];

function twice(name: string): [string, string] {
  return [name, name];
}
