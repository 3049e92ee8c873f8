/** Requests to the server; what it refuses, and what cannot be had, is told to the operator and thrown. */

import { showError } from "./dom";

interface Refusal { error?: { cause?: string; fix?: string } }

/** What a request is for: what failed if it fails, and what goes on without it. */
const MEANT: [RegExp, string, string][] = [
  [/^(objects|map|lab|promise|example)/, "The database could not be read", "Touches are still read, by what was loaded before."],
  [/^touches/, "The touches kept so far could not be had", "New ones are still read and shown."],
  [/^(touch|load|unplug)/, "The simulated probe did not do it", "Images and answers go on."],
  [/^record$/, "The recording was not switched", "Images and answers go on."],
  [/^recordings/, "The recording was not taken", "The others can be played."],
  [/^(flip|learned|mounting)/, "The sensor is read as before", "Images and answers go on."],
  [/^as-built/, "The print was not estimated", "Touches are still read; go on touching."],
  [/^scan/, "Touches are not fused", "Each of them is still read by itself."],
  [/^(replay|timeline)/, "The recording is not played", "The probe can still be chosen."],
  [/^(calibration|bias)/, "The calibration was not changed", "Readings stay as they were."],
  [/^(port|sensor)/, "The probe was not changed", "Choose it again, or another one."],
];
const OTHER = ["It was not done", "Images and answers go on."] as const;

export async function get<T>(path: string): Promise<T> {
  return answered<T>(path, await asked(path));
}

export async function remove(path: string): Promise<void> {
  await answered<object>(path, await asked(path, { method: "DELETE" }));
}

export async function post<T>(path: string, body?: object): Promise<T> {
  return answered<T>(path, await asked(path, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: body === undefined ? null : JSON.stringify(body),
  }));
}

/** Send a file in; `told` gets the share that has left. */
export function send<T>(path: string, file: Blob, told: (share: number) => void): Promise<T> {
  return new Promise((done, failed) => {
    const line = new XMLHttpRequest();
    line.upload.onprogress = (event) => told(event.lengthComputable ? event.loaded / event.total : 0);
    line.onload = () => void answered<T>(path, new Response(line.responseText, { status: line.status })).then(done, failed);
    line.onerror = () => failed(unreached(path));
    line.open("POST", `/api/${path}`);
    line.send(file);
  });
}

/** Why nothing comes from the server, as far as the browser can tell. */
export function silence(): string {
  return navigator.onLine ? "open-bench does not answer: it has ended, or the network is cut" : "this device is offline";
}

async function asked(path: string, how?: RequestInit): Promise<Response> {
  try {
    return await fetch(`/api/${path}`, how);
  } catch {
    throw unreached(path);
  }
}

function unreached(path: string): Error {
  const [, failed] = meant(path);
  showError(`${failed}: ${silence()}. What is on the page stays; open-bench is looked for all the time.`);
  return new Error(failed);
}

async function answered<T>(path: string, response: Response): Promise<T> {
  if (response.ok) return await response.json() as T;
  const told = await response.json().catch(() => ({})) as Refusal;
  const [, failed, still] = meant(path);
  const cause = told.error?.cause ?? `the server fails (${response.status})`;
  showError([`${failed}: ${cause}.`, told.error?.fix ? `${capital(told.error.fix)}.` : "", still].filter(Boolean).join(" "));
  throw new Error(cause);
}

function meant(path: string): readonly [RegExp | null, string, string] {
  return MEANT.find(([pattern]) => pattern.test(path)) ?? [null, ...OTHER];
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
