/** Touches fused into one belief, and how it shrinks from touch to touch. */

import { post } from "./api";
import { element, say } from "./dom";
import type { ScanTold } from "./types";

export class ScanPanel {
  private on = false;

  constructor() {
    element("scan").addEventListener("click", () => void post("scan", { on: !this.on }).catch(() => undefined));
  }

  tell(told: ScanTold): void {
    this.on = told.on;
    element("scan").setAttribute("aria-pressed", String(told.on));
    element("scan-box").hidden = !told.on;
    if (!told.on) return;
    const { answer } = told, count = `${told.touches} ${told.touches === 1 ? "touch" : "touches"}`;
    const slipped = told.changes ? `; given up ${told.changes} times, as touches contradicted it` : "";
    say(element("scan-text"), !told.steps.length ? "Touch the same object again and again; each touch should overlap the one before by a third."
      : answer?.object ? `${count} together: ${answer.object} ${answer.face}${answer.place ? `, x ${answer.place.x_mm.toFixed(2)}, y ${answer.place.y_mm.toFixed(2)} mm ±${answer.place.sigma_mm.toFixed(3)}` : ""}${slipped}`
        : `${count} together: not recognised yet (${answer?.because ?? "…"})${slipped}`);
    element("scan-steps").replaceChildren(...told.steps.map((step) => {
      const item = document.createElement("li"), label = document.createElement("span"), track = document.createElement("span");
      const best = step.likeliest[0];
      label.textContent = best
        ? `touch ${step.touch}: ${places(step.places)}; ${best.object} ${best.face} ${(100 * best.share).toFixed(0)} %${step.doubt === null ? "" : `; by chance ${step.doubt.toExponential(0)}`}`
        : `touch ${step.touch}: no place comes into question yet`;
      track.className = "shares";
      track.setAttribute("aria-hidden", "true");
      track.append(...step.likeliest.map((one) => {
        const part = document.createElement("span");
        part.style.width = `${100 * one.share}%`;
        return part;
      }));
      item.append(label, track);
      return item;
    }));
    element("scan-steps").scrollTop = element("scan-steps").scrollHeight;
  }
}

function places(count: number | null): string {
  if (count === null) return "no place";
  return count < 1.05 ? "one place comes into question" : `${count.toFixed(1)} places come into question`;
}
