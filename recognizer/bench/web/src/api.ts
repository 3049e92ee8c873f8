/** Requests to the server; what it refuses is shown to the operator and thrown. */

import { showError } from "./dom";

interface Refusal { error?: { cause?: string; fix?: string } }

export async function get<T>(path: string): Promise<T> {
  return answered<T>(await fetch(`/api/${path}`));
}

export async function post<T>(path: string, body?: object): Promise<T> {
  return answered<T>(await fetch(`/api/${path}`, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: body === undefined ? null : JSON.stringify(body),
  }));
}

export async function send<T>(path: string, file: Blob): Promise<T> {
  return answered<T>(await fetch(`/api/${path}`, { method: "POST", body: file }));
}

async function answered<T>(response: Response): Promise<T> {
  if (response.ok) return await response.json() as T;
  const told = await response.json().catch(() => ({})) as Refusal;
  const cause = told.error?.cause ?? `the server answers ${response.status}`;
  showError(told.error?.fix ? `${cause}. ${capital(told.error.fix)}.` : cause);
  throw new Error(cause);
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
