/** One touch in words: what it is doing, object and face, margin, pose, or why there is no answer. */

import { timeOf } from "./clock";
import { element, say } from "./dom";
import type { Answer, TouchRecord } from "./types";

const TIPS: Record<string, string> = {
  "by chance": "How many places of this database a surface of another lab would match as well by chance: the fewer, the surer the answer",
  "left unexplained": "Spread of the readings that the symbols do not explain, as a share of what a symbol reads",
  mounting: "No touch shows a quarter or half turn of the sensor: Check mounting… tells",
};
const FULL = 5; // margins of the threshold fill the bar

export class AnswerPanel {
  private readonly box = element("answer");
  private shown = "";
  simulated = false;

  constructor(private readonly threshold: number) {
    element("margin-mark").style.left = `${100 / FULL}%`;
  }

  /** Show a record; null: nothing was touched yet. */
  tell(record: TouchRecord | null, clicked_ms: number | null, past: boolean): void {
    this.box.classList.toggle("lifted", record !== null && !past && (!record.contact || record.moving));
    say(element("answer-of"), record ? heading(record, past) : "");
    const key = JSON.stringify([record?.number, record?.state, record?.answer?.read]);
    if (key === this.shown) return;
    this.shown = key;
    const answer = record?.answer ?? null;
    const name = document.createElement("p"), more = document.createElement("p");
    name.className = "name";
    more.className = "muted";
    if (!record) {
      name.textContent = "Nothing touched yet";
      name.classList.add("muted");
    } else if (!answer || record.state === "felt" || record.state === "reading") {
      name.textContent = record.state === "felt" ? "Touched…" : "Reading…";
      name.classList.add("muted");
    } else if (answer.object) {
      const face = document.createElement("small");
      face.textContent = ` ${answer.face}`;
      name.append(answer.object, face);
      more.textContent = clicked_ms === null
        ? `read in ${answer.read_ms.toFixed(0)} ms` : `read in ${answer.read_ms.toFixed(0)} ms, ${clicked_ms.toFixed(0)} ms after the click`;
    } else {
      name.classList.add("reason");
      name.textContent = `Not recognised: ${answer.because}`;
      more.className = "";
      more.textContent = answer.advice.replace("(--scan)", "(Fuse touches)");
    }
    this.box.replaceChildren(name, more);
    this.next(answer);
    this.margin(answer);
    this.pose(answer);
  }

  private next(answer: Answer | null): void {
    const next = answer?.next;
    element("next").hidden = !next;
    if (next) say(element("next-text"), `Next: ${step(next)}${next.why ? ` (${next.why})` : ""}`);
  }

  private margin(answer: Answer | null): void {
    const enough = answer !== null && (answer.alone || (answer.margin ?? 0) >= this.threshold);
    const known = answer !== null && (answer.margin !== null || answer.alone) && (answer.object !== null || !enough); // another limit refuses
    element("margin").hidden = !known;
    if (!known) return;
    const share = answer.alone ? 1 : Math.max(0, Math.min(1, answer.margin! / (FULL * this.threshold)));
    const fill = element("margin-fill");
    fill.style.width = `${100 * share}%`;
    fill.style.background = answer.object ? "var(--good)" : "var(--bad)";
    const next = answer.runner_up
      ? `runner-up: ${answer.runner_up.object} ${answer.runner_up.face}, row ${answer.runner_up.index[0]}, column ${answer.runner_up.index[1]}`
      : "no other place comes into question";
    const size = answer.alone ? "" : `margin over the next place ${answer.margin!.toFixed(1)}, ${Number(this.threshold.toFixed(1))} is needed; `;
    say(element("margin-text"), size + next);
  }

  private pose(answer: Answer | null): void {
    const rows: [string, string][] = [];
    if (answer?.place) {
      const { x_mm, y_mm, theta_deg, sigma_mm, sigma_deg } = answer.place;
      rows.push(["on the face", `x ${x_mm.toFixed(2)}, y ${y_mm.toFixed(2)} mm  ±${sigma_mm.toFixed(2)}`]);
      rows.push(["turn", `${theta_deg.toFixed(1)}°  ±${sigma_deg.toFixed(2)}`]);
    }
    if (answer?.T_object_probe) {
      const at = answer.T_object_probe.slice(0, 3).map((row) => row[3]!.toFixed(1)).join(", ");
      rows.push(["in the object", `${at} mm`]);
    }
    if (answer?.index) rows.push(["in the array", `row ${answer.index[0]}, column ${answer.index[1]}`]);
    if (answer && typeof answer.doubt === "number") rows.push(["by chance", answer.doubt.toPrecision(1)]);
    if (answer && answer.noise !== null) rows.push(["left unexplained", answer.noise.toFixed(3)]);
    if (answer?.object && answer.mounting && !this.simulated) rows.push(["mounting", answer.mounting === "checked" ? "checked" : "never checked"]);
    element("pose").replaceChildren(...rows.flatMap(([term, value]) => {
      const dt = document.createElement("dt"), dd = document.createElement("dd");
      dt.textContent = term;
      dt.title = dd.title = TIPS[term] ?? "";
      dd.textContent = value;
      return [dt, dd];
    }));
  }
}

function heading(record: TouchRecord, past: boolean): string {
  const now = past ? "seen again" : !record.contact ? "lifted" : record.moving ? "moving" : "";
  const name = record.name ? `“${record.name}”` : "";
  return [`touch ${record.number}`, name, when(record), now].filter(Boolean).join(" · ");
}

/** When a touch was made: by the clock, or in the recording that it is of. */
export function when(record: TouchRecord): string {
  return record.recording ? `${record.recording} at ${record.at_s.toFixed(2)} s` : timeOf(record.felt_ms);
}

/** A step in the sensor's frame, in words. */
export function step(next: NonNullable<Answer["next"]>): string {
  const parts: string[] = [];
  if (Math.abs(next.dx_mm) >= 0.5) parts.push(`${Math.abs(next.dx_mm).toFixed(0)} mm ${next.dx_mm > 0 ? "right" : "left"}`);
  if (Math.abs(next.dy_mm) >= 0.5) parts.push(`${Math.abs(next.dy_mm).toFixed(0)} mm ${next.dy_mm > 0 ? "up" : "down"}`);
  if (Math.abs(next.turn_deg) >= 0.5) parts.push(`turn ${next.turn_deg.toFixed(0)}°`);
  if (next.force_n) parts.push(`press ${next.force_n.toFixed(0)} N`);
  return parts.join(", ") || "the same again";
}
