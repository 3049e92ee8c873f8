/** The page's elements by their ids, and what every panel needs of them. */

export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found as T;
}

/** Set a text only where it changes: screen readers speak changes. */
export function say(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}

/** Let a button or link be used, or not: what cannot work is off. */
export function able(id: string, can: boolean): void {
  const target = element(id);
  if (target instanceof HTMLButtonElement) target.disabled = !can;
  else target.inert = !can;
}

/** Fill a list of choices, keeping the choice; nothing is touched while it is the same. */
export function choices(list: HTMLSelectElement, options: [string, string][], chosen?: string): void {
  const key = JSON.stringify(options);
  if (list.dataset["key"] !== key) {
    const before = list.value;
    list.replaceChildren(...options.map(([value, label]) => new Option(label, value)));
    list.dataset["key"] = key;
    if (options.some(([value]) => value === before)) list.value = before;
  }
  if (chosen !== undefined && document.activeElement !== list && list.value !== chosen) list.value = chosen;
}

/** Fit a canvas to the pixels that it covers; tells whether its size changed. */
export function fitted(canvas: HTMLCanvasElement): boolean {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width === width && canvas.height === height) return false;
  canvas.width = width;
  canvas.height = height;
  return true;
}

/** The colour of a custom property, as the theme has it now. */
export function themed(name: string): string {
  const probe = document.createElement("span");
  probe.style.color = `var(${name})`;
  document.body.append(probe);
  const colour = getComputedStyle(probe).color;
  probe.remove();
  return colour;
}

export function isDark(): boolean {
  const chosen = document.documentElement.dataset["theme"];
  return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

let errorTimer = 0;

/** Take the last error away: something else has happened since. */
export function clearError(): void {
  element("error").hidden = true;
}

/** Show what went wrong; in the open dialog if there is one, as all else can neither be seen nor heard then. */
export function showError(text: string): void {
  const box = element("error");
  (document.querySelector("dialog[open]") ?? document.body).append(box);
  box.textContent = text;
  box.hidden = false;
  clearTimeout(errorTimer);
  errorTimer = setTimeout(() => { box.hidden = true; }, 12000);
}
