/** Widths of the columns, changed by handles between them: by mouse, finger or arrow keys. */

import { element } from "./dom";

const STEP = 0.05, LEAST = 0.35, MOST = 3;
const USUAL = [1.25, 1, 0.72];

export class Panes {
  private readonly main = document.querySelector("main")!;
  private readonly handles = [element("pane-1"), element("pane-2")];
  private shares = [...USUAL];

  constructor() {
    const kept = (JSON.parse(localStorage.getItem("columns") ?? "null") ?? []) as number[];
    if (kept.length === USUAL.length && kept.every((one) => one >= LEAST && one <= MOST)) this.shares = kept;
    this.handles.forEach((handle, number) => this.listen(handle, number));
    new ResizeObserver(() => this.place()).observe(this.main);
    this.set(0, 0);
  }

  private listen(handle: HTMLElement, number: number): void {
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      event.preventDefault();
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const all = this.shares.slice(0, this.columns).reduce((a, b) => a + b, 0);
      this.set(number, (event.movementX / this.main.clientWidth) * all);
    });
    handle.addEventListener("keydown", (event) => {
      const by = event.key === "ArrowLeft" ? -STEP : event.key === "ArrowRight" ? STEP : 0;
      if (by) this.set(number, by);
      else if (event.key === "Home") this.reset();
      else return;
      event.preventDefault();
    });
    handle.addEventListener("dblclick", () => this.reset());
  }

  private get columns(): number { return getComputedStyle(this.main).gridTemplateColumns.split(" ").length; }

  private reset(): void {
    this.shares = [...USUAL];
    this.set(0, 0);
  }

  /** Give a column more of the width, and the one right of it less. */
  private set(number: number, by: number): void {
    const left = this.shares[number]!, right = this.shares[number + 1]!;
    const step = Math.max(LEAST - left, Math.min(by, right - LEAST, MOST - left));
    this.shares[number] = left + step;
    this.shares[number + 1] = right - step;
    this.shares.forEach((share, k) => this.main.style.setProperty(`--column-${k + 1}`, `${share.toFixed(3)}fr`));
    localStorage.setItem("columns", JSON.stringify(this.shares));
    this.place();
  }

  /** Stand the handles between the columns. */
  private place(): void {
    const { columns } = this, widths = getComputedStyle(this.main).gridTemplateColumns.split(" ").map(parseFloat);
    const gap = parseFloat(getComputedStyle(this.main).columnGap) || 0, padding = parseFloat(getComputedStyle(this.main).paddingLeft) || 0;
    let left = padding;
    this.handles.forEach((handle, number) => {
      handle.hidden = number >= columns - 1;
      left += widths[number] ?? 0;
      handle.style.left = `${left}px`;
      handle.style.width = `${gap}px`;
      left += gap;
      const all = this.shares.slice(0, columns).reduce((a, b) => a + b, 0);
      handle.setAttribute("aria-valuenow", String(Math.round((100 * this.shares[number]!) / all)));
    });
  }
}
