/** Requests to the server; what it refuses is shown to the operator and thrown. */

import { showError } from "./dom";

interface Refusal { error?: { cause?: string; fix?: string } }

export async function get<T>(path: string): Promise<T> {
  return answered<T>(await asked(path));
}

export async function remove(path: string): Promise<void> {
  await answered<object>(await asked(path, { method: "DELETE" }));
}

export async function post<T>(path: string, body?: object): Promise<T> {
  return answered<T>(await asked(path, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: body === undefined ? null : JSON.stringify(body),
  }));
}

export async function send<T>(path: string, file: Blob): Promise<T> {
  return answered<T>(await asked(path, { method: "POST", body: file }));
}

async function asked(path: string, how?: RequestInit): Promise<Response> {
  try {
    return await fetch(`/api/${path}`, how);
  } catch (error) {
    showError("open-bench does not answer. What is on the page stays; the page looks for it.");
    throw error;
  }
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
