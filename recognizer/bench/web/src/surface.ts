/** The image as a surface that can be turned and zoomed, as in the thesis's display programme. */

import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshLambertMaterial, Vector3 } from "three";
import { TABLE } from "./colours";
import { element } from "./dom";
import { Stage } from "./stage";
import type { Frame, Sensor } from "./types";

const HEIGHT_MM = 9;
const APART_MS = 40; // 25 drawings a second: the heat map keeps its own pace

export class Surface {
  private readonly stage = new Stage(element<HTMLCanvasElement>("surface"));
  private readonly places: Float32Array;
  private readonly colours: Float32Array;
  private readonly shape = new BufferGeometry();
  private readonly mesh: Mesh;
  private drawn = 0;

  constructor(private readonly sensor: Sensor) {
    const { rows, columns, pitch_mm, row_pitch_mm } = sensor;
    this.places = new Float32Array(rows * columns * 3);
    this.colours = new Float32Array(rows * columns * 3);
    for (let r = 0; r < rows; r++) for (let c = 0; c < columns; c++) {
      this.places[3 * (r * columns + c)] = (c - (columns - 1) / 2) * pitch_mm;
      this.places[3 * (r * columns + c) + 1] = ((rows - 1) / 2 - r) * row_pitch_mm;
    }
    const triangles: number[] = [];
    for (let r = 0; r + 1 < rows; r++) for (let c = 0; c + 1 < columns; c++) {
      const a = r * columns + c, b = a + columns;
      triangles.push(a, b, a + 1, a + 1, b, b + 1);
    }
    this.shape.setIndex(triangles);
    this.shape.setAttribute("position", new BufferAttribute(this.places, 3));
    this.shape.setAttribute("color", new BufferAttribute(this.colours, 3));
    const material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
    this.mesh = new Mesh(this.shape, material);
    this.mesh.frustumCulled = this.mesh.visible = false; // nothing was felt yet
    this.stage.scene.add(this.mesh);
    this.stage.look(new Vector3(0, 0, HEIGHT_MM / 4), 14, new Vector3(-0.45, -1, 0.75));
  }

  theme(): void { this.stage.theme(); }

  paint(frame: Frame, top: number): void {
    const now = performance.now();
    if (now - this.drawn < APART_MS) return;
    this.drawn = now;
    this.mesh.visible = true;
    const { rows, columns } = this.sensor;
    for (let i = 0; i < rows * columns; i++) {
      const share = Math.min(1, Math.max(0, frame.values[i]! / top));
      this.places[3 * i + 2] = share * HEIGHT_MM;
      const at = 3 * Math.round(share * 255);
      for (let c = 0; c < 3; c++) this.colours[3 * i + c] = (TABLE[at + c]! / 255) ** 2.2;
    }
    this.shape.getAttribute("position").needsUpdate = true;
    this.shape.getAttribute("color").needsUpdate = true;
    this.shape.computeVertexNormals();
    this.stage.draw();
  }
}
