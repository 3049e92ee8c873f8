/** What the server says; see recognizer/bench. mm, radians unless the name says degrees. */

export type Matrix = number[][];

export interface Sensor { type: string; rows: number; columns: number; pitch_mm: number; row_pitch_mm: number; overlay: string; overlay_mm: number; force_n: number }

export interface BenchInfo {
  ports: { url: string; label: string }[];
  database: string;
  folder: string;
  filters: string[];
  sensor: Sensor;
  margin: number;
}

export interface Feed {
  state: "none" | "waiting" | "live" | "gone" | "replay";
  cause?: string; fix?: string; device?: string; sensor?: number | null;
  rate?: number; frames?: number; lost?: number; damaged?: number; late?: number; restarts?: number; returns?: number;
  at?: number; seconds?: number; playing?: boolean; speed?: number;
}

export interface GuideStep {
  step: number; steps: number; newtons: number; ask: string; reading: boolean; done: boolean; felt: string[];
}

export interface Status {
  topic: "status";
  port: string; feed: Feed; simulated: boolean;
  calibration: { name: string; made: string; age: string; bad: number; warning: string } | null;
  bias: "none" | "taking" | "taken";
  recording: { name: string; frames: number } | null;
  guide: GuideStep | null;
  recordings: string[]; calibrations: string[];
  notices: { number: number; at_ms: number; text: string }[];
  flip: string; learning: number | null; learned: { name: string; words: string } | null; states: string[]; least: number;
  pages: number;
  started_ms: number; // another one: the server was started anew
}

export interface Answer {
  seq: number; object: string | null; face: string | null; index: [number, number] | null;
  T_face_probe: Matrix | null; T_object_probe: Matrix | null;
  margin: number | null; alone: boolean; noise: number | null;
  runner_up: { object: string; face: string; index: [number, number] } | null;
  reason: string; because: string; advice: string;
  place: { x_mm: number; y_mm: number; theta_deg: number; sigma_mm: number; sigma_deg: number } | null;
  symbols: [number, number, number, number, number][];
  turn?: number;
  window: { encoding: number; corners: [number, number][] } | null;
  next?: { dx_mm: number; dy_mm: number; turn_deg: number; force_n: number; why: string } | null;
  doubt?: number | null; mounting?: "checked" | "unchecked";
  read: number; read_ms: number; received_ms: number; answered_ms: number;
}

/** One touch: all panels show the same record. */
export interface TouchRecord {
  topic: "touch";
  number: number; felt_ms: number; time_s: number;
  state: "felt" | "reading" | "answered" | "refused";
  contact: boolean; moving: boolean; answer: Answer | null; name: string;
  dropped?: boolean;
  recording: string; at_s: number; // of a replay: its file, and when in it
}

export interface MosaicOf { topic: "mosaic-of"; object: string | null; face: string | null; touches: number }
export interface ReaderState { topic: "reader"; state: "preparing" | "ready" | "off"; cause?: string; fix?: string }
/** What touches since the scan began say together; a step each. */
export interface ScanTold {
  topic: "scan"; on: boolean; touches: number; changes: number; answer: Answer | null;
  steps: {
    touch: number; places: number | null; answered: boolean; doubt: number | null;
    likeliest: { object: string; face: string; index: [number, number]; share: number }[];
  }[];
}
export interface TouchesChanged { topic: "touches"; changes: number }
export type Told = Status | TouchRecord | TouchesChanged | ScanTold | MosaicOf | ReaderState;

export interface Frame {
  newtons: boolean; filter: number; seq: number; time_s: number; received_ms: number;
  largest: number; sum: number; values: Float32Array;
}

export interface MosaicImage {
  rows: number; columns: number; touches: number; step_mm: number; corner_mm: [number, number];
  largest: number; values: Uint8Array;
}

export interface FaceShape {
  name: string; loops: [number, number][][]; round: boolean; blank: boolean;
  corners: number[]; places: number[]; outlines: [number, number, number][][];
  labels: number[]; centres: [number, number][]; stands: number[][];
}

/** A picture on a face: its box in the face's frame or unrolled plane, mm. */
export interface FacePicture { canvas: HTMLCanvasElement; x0: number; y0: number; x1: number; y1: number }

export interface ObjectShape {
  name: string; type: string; profile: string; registered: string; pitch_mm: number; height_mm: number;
  faces: FaceShape[]; glyphs: number[][];
  parts: { number: number; name: string; format: string }[];
}

export interface ObjectEntry {
  name: string; type: string; faces: number; symbols: number; retired: boolean; profile: string; registered: string;
}

/** Shares of touches of a face, the sensor's centre on it. */
export interface Promised { at_once: number; within_three?: number | null }

export interface Encoding {
  rows: number; columns: number; alphabet: string; pitch_mm: number; stroke_mm: number; cells: number;
  objects: number; strokes: [[number, number], [number, number]][][];
}

export interface ArrayMap {
  rows: number; columns: number; order: number;
  faces: { object: string; face: string; rows: number[]; columns: number[]; labels: number[] }[];
}
