/** The answer in words: object and face, margin, pose, or the reason why there is none. */

import { element, say } from "./dom";
import type { Answer } from "./types";

const FULL = 5; // margins of the threshold fill the bar

export class AnswerPanel {
  private readonly box = element("answer");

  constructor(private readonly threshold: number) {
    element("margin-mark").style.left = `${100 / FULL}%`;
  }

  tell(answer: Answer, clicked_ms: number | null): void {
    const name = document.createElement("p"), more = document.createElement("p");
    name.className = "name";
    if (answer.object) {
      const face = document.createElement("small");
      face.textContent = ` ${answer.face}`;
      name.append(answer.object, face);
      more.className = "muted";
      more.textContent = clicked_ms === null
        ? `read in ${answer.read_ms.toFixed(0)} ms` : `read in ${answer.read_ms.toFixed(0)} ms, ${clicked_ms.toFixed(0)} ms after the click`;
    } else {
      name.classList.add("reason");
      name.textContent = `Not recognised: ${answer.reason}`;
      more.textContent = answer.advice;
    }
    this.box.replaceChildren(name, more);
    this.box.classList.remove("lifted");
    this.margin(answer);
    this.pose(answer);
  }

  contact(there: boolean): void {
    this.box.classList.toggle("lifted", !there);
  }

  private margin(answer: Answer): void {
    const known = answer.margin !== null || answer.alone;
    element("margin").hidden = !known;
    if (!known) return;
    const share = answer.alone ? 1 : Math.max(0, Math.min(1, answer.margin! / (FULL * this.threshold)));
    const fill = element("margin-fill");
    fill.style.width = `${100 * share}%`;
    fill.style.background = answer.alone || answer.margin! >= this.threshold ? "var(--good)" : "var(--bad)";
    const next = answer.runner_up
      ? `next: ${answer.runner_up.object} ${answer.runner_up.face}, row ${answer.runner_up.index[0]}, column ${answer.runner_up.index[1]}`
      : "no other place comes into question";
    const size = answer.alone ? "" : `margin ${answer.margin!.toFixed(1)} nats, ${this.threshold} are needed; `;
    say(element("margin-text"), size + next);
  }

  private pose(answer: Answer): void {
    const rows: [string, string][] = [];
    if (answer.place) {
      const { x_mm, y_mm, theta_deg, sigma_mm, sigma_deg } = answer.place;
      rows.push(["on the face", `x ${x_mm.toFixed(2)}, y ${y_mm.toFixed(2)} mm  ±${sigma_mm.toFixed(2)}`]);
      rows.push(["turn", `${theta_deg.toFixed(1)}°  ±${sigma_deg.toFixed(2)}`]);
    }
    if (answer.T_object_probe) {
      const at = answer.T_object_probe.slice(0, 3).map((row) => row[3]!.toFixed(1)).join(", ");
      rows.push(["in the object", `${at} mm`]);
    }
    if (answer.index) rows.push(["in the array", `row ${answer.index[0]}, column ${answer.index[1]}`]);
    if (answer.noise !== null) rows.push(["left unexplained", answer.noise.toFixed(3)]);
    element("pose").replaceChildren(...rows.flatMap(([term, value]) => {
      const dt = document.createElement("dt"), dd = document.createElement("dd");
      dt.textContent = term;
      dd.textContent = value;
      return [dt, dd];
    }));
  }
}
