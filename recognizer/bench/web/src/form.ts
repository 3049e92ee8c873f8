/** What can be made, as the schema of specs says it: fields, the spec that they write, the link that keeps them. */

interface Schema {
  $ref?: string; anyOf?: Schema[]; properties?: Record<string, Schema>; enum?: (string | number)[];
  format?: string; description?: string; default?: unknown; examples?: unknown[];
}

export interface Settings {
  schema: Schema & { $defs: Record<string, Schema> };
  sensor_type: string; lab: string; new: boolean;
}

const ASIDE = ["version", "encoding"]; // left to specs that are written by hand
const PLAIN = /^[\p{L}\p{N}][\p{L}\p{N} .+%°/_-]*$|^[[{]/u; // what YAML takes as it stands

export class SpecForm {
  private readonly values = new Map<string, string>(); // setting by setting, what stands after the colon
  private readonly fields = new Map<string, HTMLInputElement | HTMLSelectElement>();
  private readonly shapes: [string, Schema][];
  private readonly shape = document.createElement("select");
  private readonly sizes = document.createElement("div");

  constructor(root: HTMLElement, private readonly settings: Settings, private readonly changed: () => void) {
    const object = this.of({ $ref: "#/$defs/ObjectSettings" });
    const { shape, name, ...rest } = object;
    this.shapes = Object.entries(this.of(shape!)).filter(([, one]) => one.examples && one.format !== "path");
    const blocks = Object.entries(rest).filter(([key]) => !ASIDE.includes(key)).sort(([a], [b]) => Number(b === "print") - Number(a === "print"));
    const single = blocks.filter(([, one]) => !Object.keys(this.of(one)).length);
    root.replaceChildren(this.group("part", [["name", name!]]));
    root.firstElementChild!.append(labelled("shape", this.shape, this.describe(shape!)), this.sizes);
    this.shape.dataset["testid"] = "make-shape";
    for (const [kind] of this.shapes) this.shape.add(new Option(words(kind), kind));
    for (const [key, block] of blocks) {
      const inner = Object.entries(this.of(block)).map(([one, schema]): [string, Schema] => [`${key}.${one}`, schema]);
      if (inner.length) root.append(this.group(words(key), inner, key !== "print"));
    }
    root.lastElementChild!.before(this.group("more", single.filter(([key]) => key !== "sensor_type"), true));
    root.children[1]!.append(...single.filter(([key]) => key === "sensor_type").map(([key, one]) => this.field(key, one)));
    this.shape.addEventListener("change", () => {
      this.choose(this.shape.value);
      this.changed();
    });
  }

  /** Fill the form as a link says; returns its settings that are not there, or whose values are too long. */
  fill(link: URLSearchParams): string[] {
    const given = [...link].filter(([, value]) => value.length < 2000);
    const kind = given.map(([path]) => /^shape\.(\w+)/.exec(path)?.[1]).find((one) => this.shapes.some(([known]) => known === one));
    this.values.clear();
    for (const field of this.fields.values()) field.value = "";
    this.choose(kind ?? this.shapes[0]![0], kind !== undefined);
    for (const [path, value] of [["name", "Part"], ["sensor_type", this.settings.sensor_type], ...given] as [string, string][]) this.set(path, value);
    return [...link].filter(([path, value]) => this.fields.get(path)?.value !== value).map(([path]) => path.slice(0, 60));
  }

  get link(): string { return `#make?${new URLSearchParams([...this.values])}`; }
  get name(): string { return this.values.get("name") ?? ""; }

  /** The spec as YAML, and the setting on each of its lines. */
  spec(): { text: string; paths: string[] } {
    const lines: string[] = [], paths: string[] = [];
    let open: string[] = [];
    const rank = (path: string): number => (path === "name" ? 0 : path.startsWith("shape") ? 1 : 2);
    for (const path of [...this.fields.keys()].sort((a, b) => rank(a) - rank(b))) {
      const value = this.values.get(path), keys = path.split(".");
      if (value === undefined) continue;
      const same = keys.findIndex((key, depth) => key !== open[depth]);
      keys.slice(0, -1).forEach((key, depth) => {
        if (depth < same) return;
        lines.push(`${"  ".repeat(depth)}${key}:`);
        paths.push(path);
      });
      lines.push(`${"  ".repeat(keys.length - 1)}${keys.at(-1)}: ${PLAIN.test(value) ? value : JSON.stringify(value)}`);
      paths.push(path);
      open = keys;
    }
    return { text: `${lines.join("\n")}\n`, paths };
  }

  /** Mark the fields whose settings are refused. */
  mark(refused: string[]): void {
    for (const [path, field] of this.fields) field.setAttribute("aria-invalid", String(refused.includes(path)));
  }

  private choose(kind: string, bare = false): void {
    const schema = this.shapes.find(([one]) => one === kind)![1], example = schema.examples![0];
    for (const path of [...this.fields.keys()]) {
      if (!path.startsWith("shape.")) continue;
      this.fields.delete(path);
      this.values.delete(path);
    }
    this.shape.value = kind;
    const inner = Object.entries(this.of(schema)).map(([key, one]): [string, Schema] => [`shape.${kind}.${key}`, one]);
    const sizes = inner.length ? inner : [[`shape.${kind}`, schema] as [string, Schema]];
    this.sizes.replaceChildren(...sizes.map(([path, one]) => this.field(path, one)));
    if (bare) return;
    if (!inner.length) this.set(`shape.${kind}`, flow(example));
    else for (const [key, value] of Object.entries(example as object)) this.set(`shape.${kind}.${key}`, flow(value));
  }

  private group(title: string, settings: [string, Schema][], closed = false): HTMLElement {
    const group = document.createElement(closed ? "details" : "fieldset"), head = document.createElement(closed ? "summary" : "legend");
    head.textContent = title;
    group.append(head, ...settings.filter(([, one]) => one.format !== "path").map(([path, one]) => this.field(path, one)));
    return group;
  }

  private field(path: string, schema: Schema): HTMLElement {
    const names = this.choices(schema).map(String);
    const field = document.createElement(names.length ? "select" : "input");
    if (field instanceof HTMLSelectElement) {
      const usual = schema.default === undefined ? "usual" : `${String(schema.default)} (usual)`;
      field.append(new Option(usual, ""), ...names.filter((one) => one !== String(schema.default)).map((one) => new Option(one, one)));
    } else {
      field.placeholder = String(schema.default ?? "usual");
      field.autocomplete = "off";
      field.maxLength = 400;
      field.addEventListener("keydown", (event) => step(event, field));
    }
    field.dataset["testid"] = `make-${path}`;
    field.addEventListener("input", () => {
      this.set(path, field.value);
      this.changed();
    });
    this.fields.set(path, field);
    return labelled(words(path.split(".").at(-1)!), field, this.describe(schema));
  }

  private set(path: string, value: string): void {
    const field = this.fields.get(path);
    if (!field) return;
    if (field.value !== value) field.value = value;
    if (field.value.trim()) this.values.set(path, field.value.trim()); // a list takes its own names alone
    else this.values.delete(path);
  }

  /** The settings of a block; none of a single setting. */
  private of({ $ref, properties }: Schema): Record<string, Schema> {
    return properties ?? ($ref ? this.of(this.settings.schema.$defs[$ref.split("/").at(-1)!]!) : {});
  }

  /** The values that a setting takes, or the names that it knows: several examples. */
  private choices({ enum: own, anyOf, examples }: Schema): unknown[] {
    return own ?? (examples?.[1] ? examples : anyOf?.flatMap((one) => this.choices(one)) ?? []);
  }

  private describe({ description, $ref }: Schema): string {
    return description ?? ($ref ? this.settings.schema.$defs[$ref.split("/").at(-1)!]?.description ?? "" : "");
  }
}

function labelled(text: string, field: HTMLElement, tip: string): HTMLElement {
  const label = document.createElement("label"), name = document.createElement("span");
  name.textContent = text;
  field.title = label.title = tip.replaceAll("\n", " ");
  label.append(name, field);
  return label;
}

function words(key: string): string { return key.replaceAll("_", " "); }

/** A value as YAML writes it on a line. */
function flow(value: unknown): string {
  return Array.isArray(value) ? `[${value.map(flow).join(", ")}]` : String(value);
}

/** Up and down change the number at the cursor, by 10 with Shift. */
function step(event: KeyboardEvent, field: HTMLInputElement): void {
  const by = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0, at = field.selectionStart ?? 0;
  const numbers = [...field.value.matchAll(/\d+(\.\d+)?/g)], found = numbers.findLast(({ index }) => index <= at) ?? numbers[0];
  if (!by || !found) return;
  event.preventDefault();
  const next = Math.max(0, Number(found[0]) + by * (event.shiftKey ? 10 : 1));
  field.setRangeText(String(Number(next.toFixed(6))), found.index, found.index + found[0].length, "preserve");
  field.dispatchEvent(new Event("input"));
}
