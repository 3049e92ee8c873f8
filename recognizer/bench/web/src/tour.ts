/** Four steps through the page, at its first use and whenever it is asked for. */

import { element, say } from "./dom";

const STEPS: [string, string, string][] = [
  [".part", "Touch the part", "Click on the part, and the simulated probe comes down there. With a probe of your own, touch the printed part. Gallery shows every object of the lab."],
  [".answer", "Read the answer", "Object, face and place of the touch, and how sure they are. Where it does not answer it says why, and where to touch next."],
  [".touches", "Go back", "Every touch stays here: click one to see it again, name it, compare two with Shift, save them all."],
  [".work", "Work with your probe", "Choose its port, calibrate it, check how it is mounted and how the part was printed, record and replay."],
];

export class Tour {
  private readonly card = element("tour");
  private at = 0;

  constructor() {
    element("tour-open").addEventListener("click", () => this.go(0));
    element("tour-next").addEventListener("click", () => this.go(this.at + 1));
    element("tour-back").addEventListener("click", () => this.go(this.at - 1));
    element("tour-end").addEventListener("click", () => this.end());
    this.card.addEventListener("keydown", (event) => { if (event.key === "Escape") this.end(); });
    if (!localStorage.getItem("toured")) this.go(0, false);
  }

  private go(at: number, focus = true): void {
    if (at >= STEPS.length) {
      this.end();
      return;
    }
    this.at = Math.max(0, at);
    const [where, title, text] = STEPS[this.at]!;
    this.card.hidden = false;
    say(element("tour-title"), `${this.at + 1} of ${STEPS.length}: ${title}`);
    say(element("tour-text"), text);
    say(element("tour-next"), this.at + 1 === STEPS.length ? "Done" : "Next");
    element<HTMLButtonElement>("tour-back").disabled = this.at === 0;
    for (const panel of document.querySelectorAll(".panel")) panel.classList.toggle("toured", panel.matches(where));
    if (!focus) return;
    document.querySelector(where)?.scrollIntoView({ block: "nearest" });
    element("tour-next").focus();
  }

  private end(): void {
    localStorage.setItem("toured", "yes");
    this.card.hidden = true;
    for (const panel of document.querySelectorAll(".toured")) panel.classList.remove("toured");
    element("tour-open").focus({ preventScroll: true });
  }
}
