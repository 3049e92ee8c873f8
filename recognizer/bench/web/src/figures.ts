/** What tests and measurements ask of the page: `bench` in its window. */

export const figures = {
  frames: 0, paints: 0, latency_ms: [] as number[], answers: 0, click_ms: [] as number[],
  lit: "", shown: "", contact: false, touch: 0, state: "", tried: 0, tried_ms: 0, made: 0,
};
Object.assign(window, { bench: figures });

const KEPT = 5000;

export function keep(list: number[], value: number): void {
  list.push(value);
  if (list.length > KEPT) list.splice(0, KEPT / 2);
}
