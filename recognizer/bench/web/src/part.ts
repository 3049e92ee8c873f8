/** The part with its embossed faces, the recognised face lit, the probe standing on it. */

import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, Float32BufferAttribute, Group, InstancedMesh, LineBasicMaterial, LineSegments,
  Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, Object3D, Raycaster, RingGeometry, Sphere, Triangle, Vector2, Vector3,
} from "three";
import { element, isDark } from "./dom";
import { matrixOf, outlinesOf, pictureMesh, probeOf, symbolsOf } from "./meshes";
import { Stage } from "./stage";
import type { Answer, FacePicture, FaceShape, Matrix, ObjectShape, Sensor } from "./types";

const STILL_PX = 5; // farther, a press of the button is a turn and no click

export interface Place { face: string; x_mm: number; y_mm: number }

export class Part {
  private readonly stage: Stage;
  private readonly probe: Group;
  private readonly ring: Mesh;
  private held: Group | null = null;
  private faces: Mesh | null = null;
  private faceOf: Uint16Array = new Uint16Array(0);
  private symbols: { mesh: InstancedMesh; faces: Uint16Array }[] = [];
  private edges: LineBasicMaterial | null = null;
  private lit = -1;
  private told: [Answer | null, boolean] = [null, false];
  private stands = true;
  private colours = new Map<string, string>(); // of faces by name
  private painted: Mesh[] = [];
  shape: ObjectShape | null = null;

  /** `touched` is told where the part is clicked on; null: it is to be looked at alone. */
  constructor(sensor: Sensor, private readonly touched: ((place: Place) => void) | null, canvas = element<HTMLCanvasElement>("part")) {
    this.stage = new Stage(canvas);
    this.probe = probeOf(sensor);
    this.ring = new Mesh(new RingGeometry(1.6, 2.3, 32),
      new MeshLambertMaterial({ color: 0xd97a00, side: DoubleSide, depthTest: false }));
    this.ring.renderOrder = 2;
    this.probe.visible = this.ring.visible = false;
    this.stage.scene.add(this.probe, this.ring);
    if (touched) this.listen();
  }

  theme(): void {
    this.colour();
    this.stage.theme();
  }

  /** Show an object, from the usual side or as the last one was seen. */
  show(shape: ObjectShape, asBefore = false): void {
    const from = asBefore && this.held ? this.stage.camera.position.clone().sub(this.stage.target) : new Vector3(0.55, -1, 0.6);
    this.clear();
    this.shape = shape;
    const held = new Group();
    this.faces = this.facesOf(shape);
    this.edges = new LineBasicMaterial();
    held.add(this.faces, new LineSegments(outlinesOf(shape), this.edges));
    this.symbols = symbolsOf(shape);
    held.add(...this.symbols.map((one) => one.mesh));
    this.held = held;
    this.stage.scene.add(held);
    this.tint(new Map(), new Map(), false);
    const ball = new Sphere();
    this.faces.geometry.computeBoundingSphere();
    ball.copy(this.faces.geometry.boundingSphere!);
    this.stage.look(ball.center, ball.radius, from);
    this.lit = -1;
    this.colour();
  }

  /** Light the recognised face and stand the probe on it; null: nothing is known. */
  tell(answer: Answer | null, contact: boolean): void {
    this.told = [answer, contact];
    const here = answer !== null && answer.object !== null && answer.object === this.shape?.name;
    const lit = here ? this.shape!.faces.findIndex((face) => face.name === answer.face) : -1;
    if (lit !== this.lit) {
      this.lit = lit;
      this.colour();
    }
    this.ring.visible = false;
    this.probe.visible = this.stands && here && answer.T_object_probe !== null;
    if (this.probe.visible) {
      const stands = matrixOf(answer!.T_object_probe!);
      if (!contact) stands.multiply(new Matrix4().makeTranslation(0, 0, 8));
      this.probe.matrix.copy(stands);
      this.probe.matrixWorldNeedsUpdate = true;
    }
    this.stage.draw();
  }

  /** Show the probe, or leave the part alone. */
  withProbe(stands: boolean): void {
    this.stands = stands;
    this.tell(...this.told);
  }

  /** Colour faces, and lay pictures on them; symbols may be left out where a picture shows them. */
  tint(colours: Map<string, string>, pictures: Map<string, FacePicture>, bare: boolean): void {
    this.colours = colours;
    for (const mesh of this.painted) {
      mesh.geometry.dispose();
      const material = mesh.material as MeshBasicMaterial;
      material.map?.dispose();
      material.dispose();
      mesh.removeFromParent();
    }
    this.painted = (this.shape?.faces ?? []).flatMap((face) => {
      const picture = pictures.get(face.name);
      return picture ? [pictureMesh(picture, face)] : [];
    });
    if (this.painted.length) this.held?.add(...this.painted);
    for (const { mesh } of this.symbols) mesh.visible = !bare;
    this.colour();
  }

  get litFace(): string { return this.shape?.faces[this.lit]?.name ?? ""; }

  /** Turn the part so that a place on it is seen, as the probe stands there. */
  face(T_object_probe: Matrix): void {
    const out = new Vector3().setFromMatrixColumn(matrixOf(T_object_probe), 2);
    const now = this.stage.camera.position.clone().sub(this.stage.target).normalize();
    if (now.dot(out) > 0.35) return;
    this.stage.glide(out.add(new Vector3(0.3, -0.35, 0.3)));
  }

  private facesOf(shape: ObjectShape): Mesh {
    const corners = shape.faces.flatMap((face) => face.corners);
    const faceOf = shape.faces.flatMap((face, number) => new Array<number>(face.corners.length / 9).fill(number));
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(corners, 3));
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(corners.length), 3));
    geometry.computeVertexNormals();
    this.faceOf = Uint16Array.from(faceOf);
    const material = new MeshLambertMaterial({
      vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    return new Mesh(geometry, material);
  }

  private colour(): void {
    if (!this.faces || !this.edges) return;
    const dark = isDark();
    const plain = new Color(dark ? 0x4c5867 : 0xd5dce4), lit = new Color(dark ? 0xb06d14 : 0xf4b45f);
    const symbol = new Color(dark ? 0x8d9bac : 0x8fa1b3), litSymbol = new Color(dark ? 0xffc46f : 0xb25f00);
    const colours = this.faces.geometry.getAttribute("color");
    const own = (this.shape?.faces ?? []).map((one) => {
      const name = this.colours.get(one.name);
      return name === undefined ? undefined : new Color(name);
    });
    this.faceOf.forEach((face, triangle) => {
      const { r, g, b } = own[face] ?? (face === this.lit ? lit : plain);
      for (let k = 0; k < 3; k++) colours.setXYZ(3 * triangle + k, r, g, b);
    });
    colours.needsUpdate = true;
    for (const { mesh, faces } of this.symbols) {
      faces.forEach((face, i) => mesh.setColorAt(i, face === this.lit ? litSymbol : symbol));
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
    this.edges.color.set(dark ? 0x0d1116 : 0x7d8a99);
    this.stage.draw();
  }

  private clear(): void {
    if (!this.held) return;
    this.stage.scene.remove(this.held);
    this.held.traverse((one: Object3D) => {
      if (one instanceof Mesh || one instanceof LineSegments) one.geometry.dispose();
    });
  }

  private listen(): void {
    const canvas = this.stage.canvas;
    let down: [number, number] | null = null;
    canvas.addEventListener("pointerdown", (event) => { down = event.button === 0 ? [event.clientX, event.clientY] : null; });
    canvas.addEventListener("pointerup", (event) => {
      if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < STILL_PX) {
        const box = canvas.getBoundingClientRect();
        this.pick((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
      }
      down = null;
    });
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.pick(0.5, 0.5);
    });
  }

  /** Touch what is seen at a place of the canvas, 0 ... 1 from its upper left corner. */
  private pick(across: number, down: number): void {
    if (!this.faces || !this.shape) return;
    const ray = new Raycaster();
    this.stage.camera.updateMatrixWorld();
    ray.setFromCamera(new Vector2(2 * across - 1, 1 - 2 * down), this.stage.camera);
    const hit = ray.intersectObject(this.faces)[0];
    const face = hit && this.shape.faces[this.faceOf[hit.faceIndex!]!];
    if (!hit || !face) return;
    this.ring.position.copy(hit.point).addScaledVector(hit.face!.normal, this.shape.height_mm + 0.2);
    this.ring.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), hit.face!.normal);
    this.ring.visible = true;
    this.stage.draw();
    const at = this.placeOf(face, hit.faceIndex!, hit.point);
    this.touched?.({ face: face.name, x_mm: at.x, y_mm: at.y });
  }

  /** The place on a face of a point on one of its triangles; of a round face, in its unrolled plane. */
  private placeOf(face: FaceShape, triangle: number, point: Vector3): Vector2 {
    const k = triangle - this.faceOf.indexOf(this.shape!.faces.indexOf(face));
    const [a, b, c] = [0, 3, 6].map((i) => new Vector3().fromArray(face.corners, 9 * k + i)) as [Vector3, Vector3, Vector3];
    const share = Triangle.getBarycoord(point, a, b, c, new Vector3()) ?? new Vector3(1, 0, 0);
    const at = new Vector2();
    share.toArray().forEach((part, i) => at.addScaledVector(new Vector2().fromArray(face.places, 6 * k + 2 * i), part));
    return at;
  }
}
