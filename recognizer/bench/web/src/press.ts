/** Where the simulated probe comes down: the form, a click on the part, what an answer proposes. */

import { post } from "./api";
import { choices, element } from "./dom";
import type { Place } from "./part";
import type { ObjectShape } from "./types";

export class PressForm {
  private readonly face = element<HTMLSelectElement>("touch-face");
  private shape: ObjectShape | null = null;
  private clicked: number | null = null;

  constructor(private readonly force_n: number, private readonly pressed: () => void) {
    element<HTMLInputElement>("touch-force").value = force_n.toPrecision(3);
    this.face.addEventListener("change", () => this.middle());
    element("touch").addEventListener("submit", (event) => {
      event.preventDefault();
      void this.touch(this.place()).catch(() => undefined);
    });
    element("next-go").addEventListener("click", () => {
      this.clicked = performance.now();
      void post("touch/next").catch(() => undefined);
    });
  }

  /** Offer the faces of an object; one shown again keeps the form as it was filled in. */
  show(shape: ObjectShape): void {
    const again = this.shape?.name === shape.name, face = this.face.value;
    this.shape = shape;
    choices(this.face, shape.faces.filter((one) => !one.blank).map((one) => [one.name, one.name]));
    if (!again || this.face.value !== face) this.middle();
  }

  simulated(there: boolean): void {
    element("touch").querySelector("button")!.disabled = !there;
    element("next-go").hidden = !there;
  }

  /** What the form says now. */
  place(): Place {
    return { face: this.face.value, x_mm: number("touch-x"), y_mm: number("touch-y") };
  }

  async touch(place: Place): Promise<void> {
    this.face.value = place.face;
    for (const [id, value] of [["touch-x", place.x_mm], ["touch-y", place.y_mm]] as const) element<HTMLInputElement>(id).value = value.toFixed(1);
    await this.press(place.face, place.x_mm, place.y_mm, number("touch-theta"), number("touch-force"));
  }

  /** Let the simulated probe come down on the object that is shown; as hard as its type takes. */
  async press(face: string, x_mm: number, y_mm: number, theta_deg: number, force_n = this.force_n): Promise<void> {
    this.pressed();
    this.clicked = performance.now();
    await post("touch", { object: this.shape?.name ?? "", face, x_mm, y_mm, theta_deg, force_n });
  }

  /** How long ago it was asked for, ms; once, for the first answer. */
  since(): number | null {
    const { clicked } = this;
    this.clicked = null;
    return clicked === null ? null : performance.now() - clicked;
  }

  /** Put the middle of the chosen face in the form. */
  private middle(): void {
    const face = this.shape?.faces.find((one) => one.name === this.face.value);
    if (!face?.centres.length) return;
    const mean = (k: 0 | 1): string => (face.centres.reduce((sum, c) => sum + c[k], 0) / face.centres.length).toFixed(1);
    element<HTMLInputElement>("touch-x").value = mean(0);
    element<HTMLInputElement>("touch-y").value = mean(1);
  }
}

function number(id: string): number {
  return Number(element<HTMLInputElement>(id).value);
}
