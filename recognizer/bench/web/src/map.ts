/** The array with every registered face, and the window that was read; only what is placed is drawn. */

import { hue } from "./colours";
import { element, fitted, isDark, say, themed } from "./dom";
import type { Answer, ArrayMap } from "./types";

interface View { row: number; column: number; cells: number } // middle, and cells across the canvas

export class MapPanel {
  private readonly canvas = element<HTMLCanvasElement>("map");
  private readonly ink = this.canvas.getContext("2d")!;
  private readonly text = element("map-text");
  private map: ArrayMap | null = null;
  private owners = new Map<string, number>();
  private objects: string[] = [];
  private view: View = { row: 0, column: 0, cells: 64 };
  private answer: Answer | null = null;
  private waiting = false;
  number = 0;

  constructor(private readonly chosen: (object: string) => void) {
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    element("map-all").addEventListener("click", () => this.all());
    element("map-window").addEventListener("click", () => this.near());
    this.listen();
  }

  show(map: ArrayMap, number: number): void {
    this.map = map;
    this.number = number;
    this.owners.clear();
    this.objects = [...new Set(map.faces.map((face) => face.object))];
    map.faces.forEach((face, n) => face.rows.forEach((row, i) => this.owners.set(`${row},${face.columns[i]}`, n)));
    say(this.text, `${map.rows} × ${map.columns} cells, ${this.owners.size.toLocaleString("en")} taken by ${this.objects.length} object${this.objects.length === 1 ? "" : "s"}`);
    this.all();
  }

  tell(answer: Answer | null): void {
    this.answer = answer;
    if (answer?.object) say(this.text, `read: ${answer.object} ${answer.face}, row ${answer.index?.[0]}, column ${answer.index?.[1]}`);
    this.draw();
  }

  theme(): void { this.draw(); }

  private all(): void {
    if (!this.map) return;
    const [r, high] = arc(this.map.faces.flatMap((face) => face.rows), this.map.rows);
    const [c, wide] = arc(this.map.faces.flatMap((face) => face.columns), this.map.columns);
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const cells = 1.06 * Math.max(wide, (high * w) / Math.max(h, 1));
    this.view = { row: r + high / 2, column: c + wide / 2, cells };
    this.draw();
  }

  private near(): void {
    if (!this.answer?.index) return;
    this.view = { row: this.answer.index[0] + 0.5, column: this.answer.index[1] + 0.5, cells: 24 };
    this.draw();
  }

  private draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  private paint(): void {
    fitted(this.canvas);
    const { ink, map } = this, { width, height } = this.canvas, dark = isDark();
    ink.fillStyle = themed("--field");
    ink.fillRect(0, 0, width, height);
    if (!map) return;
    const { unit, x, y } = this.scale();
    ink.strokeStyle = themed("--line");
    ink.lineWidth = 1;
    ink.strokeRect(x(0), y(0), map.columns * unit, map.rows * unit);
    const gap = unit > 6 ? 1 : 0, side = Math.max(unit - gap, 1.2);
    map.faces.forEach((face) => {
      const lit = this.answer?.object === face.object && this.answer.face === face.face;
      const colour = hue(this.objects.indexOf(face.object));
      for (let i = 0; i < face.rows.length; i++) {
        const [down, across] = this.around(face.rows[i]!, face.columns[i]!);
        const left = x(face.columns[i]! + across), above = y(face.rows[i]! + down);
        if (left < -unit || above < -unit || left > width || above > height) continue;
        const shade = (dark ? 34 : 78) + (dark ? 7 : -6) * (face.labels[i]! % 4);
        ink.fillStyle = lit ? `hsl(34 95% ${dark ? 48 : 62}%)` : `hsl(${colour} 38% ${shade}%)`;
        ink.fillRect(left, above, side, side);
      }
    });
    this.window(unit, x, y);
  }

  /** By how much a cell is shown beside its place: the array is a torus, and what is seen of it may lie across its border. */
  private around(row: number, column: number): [number, number] {
    const { rows, columns } = this.map!, { width, height } = this.canvas, across = this.view.cells, down = (across * height) / width;
    return [
      down < rows ? rows * Math.round((this.view.row - row) / rows) : 0,
      across < columns ? columns * Math.round((this.view.column - column) / columns) : 0,
    ];
  }

  /** The sensor's outline on the torus: where it crosses the border it is drawn on both sides. */
  private window(unit: number, x: (c: number) => number, y: (r: number) => number): void {
    const corners = this.answer?.window?.encoding === this.number ? this.answer.window.corners : null;
    if (!corners || !this.map) return;
    const { ink, map } = this, [row, column] = this.around(...corners[0]!);
    const all = corners.map(([r, c]): [number, number] => [r + row, c + column]);
    for (const down of [-map.rows, 0, map.rows]) for (const across of [-map.columns, 0, map.columns]) {
      const seen = all.some(([r, c]) => this.seen(r + down, c + across));
      if (!seen) continue;
      ink.beginPath();
      all.forEach(([r, c], i) => ink[i ? "lineTo" : "moveTo"](x(c + across), y(r + down)));
      ink.closePath();
      ink.lineWidth = Math.max(2, Math.min(4, unit / 3));
      ink.strokeStyle = themed("--accent");
      ink.stroke();
    }
  }

  /** Whether a place is on the canvas, and on the array where all of that is. */
  private seen(row: number, column: number): boolean {
    const { rows, columns } = this.map!, { width, height } = this.canvas, across = this.view.cells, down = (across * height) / width;
    return (down < rows ? Math.abs(row - this.view.row) < down : row > 0 && row < rows)
      && (across < columns ? Math.abs(column - this.view.column) < across : column > 0 && column < columns);
  }

  private scale(): { unit: number; x: (c: number) => number; y: (r: number) => number } {
    const { width, height } = this.canvas, { row, column, cells } = this.view, unit = width / cells;
    return {
      unit,
      x: (c) => width / 2 + (c - column) * unit,
      y: (r) => height / 2 + (r - row) * unit,
    };
  }

  private cellAt(event: MouseEvent): [number, number] {
    const box = this.canvas.getBoundingClientRect(), unit = box.width / this.view.cells;
    const at = (cell: number, size: number): number => ((Math.floor(cell) % size) + size) % size;
    return [
      at(this.view.row + (event.clientY - box.top - box.height / 2) / unit, this.map?.rows ?? 1),
      at(this.view.column + (event.clientX - box.left - box.width / 2) / unit, this.map?.columns ?? 1),
    ];
  }

  private zoom(by: number): void {
    const most = 3 * Math.max(this.map?.rows ?? 64, this.map?.columns ?? 64);
    this.view = { ...this.view, cells: Math.min(most, Math.max(6, this.view.cells * by)) };
    this.draw();
  }

  private listen(): void {
    const canvas = this.canvas;
    let from: [number, number] | null = null, moved = 0;
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(event.deltaY > 0 ? 1.15 : 1 / 1.15); }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      from = [event.clientX, event.clientY];
      moved = 0;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (from) {
        const unit = canvas.clientWidth / this.view.cells, [x, y] = from;
        moved += Math.abs(event.clientX - x) + Math.abs(event.clientY - y);
        this.view = { ...this.view, column: this.view.column - (event.clientX - x) / unit, row: this.view.row - (event.clientY - y) / unit };
        from = [event.clientX, event.clientY];
        this.draw();
        return;
      }
      const [row, column] = this.cellAt(event), owner = this.owners.get(`${row},${column}`);
      const face = owner === undefined ? null : this.map?.faces[owner];
      say(this.text, face ? `${face.object} ${face.face}, row ${row}, column ${column}` : `row ${row}, column ${column}`);
    });
    canvas.addEventListener("pointerup", (event) => {
      from = null;
      if (moved > 4) return;
      const [row, column] = this.cellAt(event), owner = this.owners.get(`${row},${column}`);
      const face = owner === undefined ? null : this.map?.faces[owner];
      if (face) this.chosen(face.object);
    });
    canvas.addEventListener("keydown", (event) => {
      const step = this.view.cells / 12;
      const moves: Record<string, [number, number]> = {
        ArrowLeft: [0, -step], ArrowRight: [0, step], ArrowUp: [-step, 0], ArrowDown: [step, 0],
      };
      const move = moves[event.key];
      if (move) this.view = { ...this.view, row: this.view.row + move[0], column: this.view.column + move[1] };
      else if (event.key === "+" || event.key === "=") this.zoom(1 / 1.25);
      else if (event.key === "-") this.zoom(1.25);
      else return;
      event.preventDefault();
      this.draw();
    });
  }
}

/** The shortest stretch of a ring of cells that holds these: where it begins, and how long it is. */
function arc(cells: number[], size: number): [number, number] {
  const held = [...new Set(cells)].sort((a, b) => a - b);
  let from = 0, gap = 0;
  held.forEach((cell, i) => {
    const next = held[i + 1] ?? held[0]! + size;
    if (next - cell > gap) [from, gap] = [next % size, next - cell];
  });
  return gap > size / 4 ? [from, size - gap + 1] : [0, size];
}
