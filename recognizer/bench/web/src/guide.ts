/** Calibration, a load at a time. */

import { post } from "./api";
import { element, say } from "./dom";
import type { Status } from "./types";

interface Result { name: string; bad: number; tactels: number; scatter: number }

export class GuideDialog {
  private readonly dialog = element<HTMLDialogElement>("guide");
  private status: Status | null = null;
  private loading = false;

  constructor() {
    element("calibrate").addEventListener("click", () => {
      say(element("guide-result"), "");
      this.dialog.showModal();
    });
    element("guide-start").addEventListener("click", () => void this.begin().catch(() => undefined));
    element("guide-read").addEventListener("click", () => void post("calibration", { do: "read" }).catch(() => undefined));
    element("guide-again").addEventListener("click", () => void post("calibration", { do: "again" }).catch(() => undefined));
    element("guide-load").addEventListener("click", () => void this.load().catch(() => undefined));
    element("guide-finish").addEventListener("click", () => void this.finish().catch(() => undefined));
    this.dialog.addEventListener("close", () => void this.close().catch(() => undefined));
  }

  tell(status: Status): void {
    this.status = status;
    const guide = status.guide;
    element("guide-begin").hidden = guide !== null;
    element("guide-steps").hidden = guide === null;
    element<HTMLButtonElement>("calibrate").disabled = status.feed.state !== "live";
    if (!guide) return;
    const ask = guide.reading ? "Reading… keep it still." : guide.done ? guide.ask : `${guide.step + 1} of ${guide.steps}: ${guide.ask}`;
    say(element("guide-ask"), ask);
    this.allowReading();
    element<HTMLButtonElement>("guide-again").disabled = guide.reading || guide.step === 0;
    element("guide-finish").hidden = !guide.done;
    element("guide-load").hidden = !status.simulated || guide.done;
    element("guide-load").textContent = guide.newtons ? `Put ${guide.newtons} N on (simulated)` : "Unload (simulated)";
    const felt = element("guide-felt");
    if (felt.children.length !== guide.felt.length) {
      felt.replaceChildren(...guide.felt.map((text) => {
        const item = document.createElement("li");
        item.textContent = text;
        return item;
      }));
    }
  }

  private async begin(): Promise<void> {
    const newtons = element<HTMLInputElement>("guide-loads").value.split(/[,\s]+/).filter(Boolean).map(Number);
    await post("calibration", {
      do: "begin", newtons, seconds: Number(element<HTMLInputElement>("guide-seconds").value),
      simulated_board: this.status?.simulated ?? false,
    });
  }

  /** Put the simulated load on; nothing is read before it is on. */
  private async load(): Promise<void> {
    this.loading = true;
    this.allowReading();
    try {
      await post("load", { newtons: this.status?.guide?.newtons ?? 0 });
    } finally {
      this.loading = false;
      this.allowReading();
    }
  }

  private allowReading(): void {
    const guide = this.status?.guide;
    element<HTMLButtonElement>("guide-read").disabled = this.loading || !guide || guide.reading || guide.done;
  }

  private async finish(): Promise<void> {
    const found = await post<Result>("calibration", { do: "finish" });
    say(element("guide-result"), `${found.name}: ${found.tactels - found.bad} of ${found.tactels} tactels are sound, `
      + `scatter ${found.scatter} of the expected. It is in use.`);
  }

  private async close(): Promise<void> {
    if (this.status?.guide) await post("calibration", { do: "cancel" });
    if (this.status?.simulated) await post("load", { newtons: 0 });
  }
}
