/** The server's clock as this machine sees it: times are told by the server, shown by this clock. */

import { get } from "./api";

const TRIES = 4;
let ahead_ms = 0; // of the server's clock before this one

/** Ask the server for its time; the fastest of a few answers tells best. */
export async function setClock(): Promise<void> {
  let fastest = Infinity, ahead = 0;
  for (let i = 0; i < TRIES; i++) {
    const asked = now(), { now_ms } = await get<{ now_ms: number }>("clock"), took = now() - asked;
    if (took < fastest) [fastest, ahead] = [took, now_ms - (asked + took / 2)];
  }
  ahead_ms = Math.abs(ahead) > fastest / 2 ? ahead : 0; // no less is known than half of the way there and back
}

/** How long ago a time of the server was, ms. */
export function since(server_ms: number): number {
  return now() + ahead_ms - server_ms;
}

/** A time of the server as this machine's clocks show it. */
export function timeOf(server_ms: number): string {
  return new Date(server_ms - ahead_ms).toLocaleTimeString("en-GB");
}

function now(): number {
  return performance.timeOrigin + performance.now();
}
