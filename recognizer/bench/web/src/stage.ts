/** A three-dimensional view: camera, light, turning by mouse and keys, drawn when it changes. */

import {
  AmbientLight, Color, DirectionalLight, PerspectiveCamera, Scene, Spherical, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { isDark } from "./dom";

const FIELD = Math.tan(Math.PI * 16 / 180); // half of the lower side of what is seen, at a distance of 1
const NARROW = 1.25; // width over height, under which the width is kept instead of the height
const STEP = Math.PI / 24;
const GLIDE_MS = 350;

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(32, 0, 0.5, 5000);
  private readonly renderer: WebGLRenderer;
  private readonly controls: OrbitControls;
  private waiting = false;
  private gliding = 0; // number of the turn that is made; another one ends it

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "low-power" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.camera.up.set(0, 0, 1);
    const sun = new DirectionalLight(0xffffff, 2.1);
    sun.position.set(-0.5, 0.8, 1);
    this.camera.add(sun);
    this.scene.add(this.camera, new AmbientLight(0xffffff, 1.1));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => { this.gliding++; });
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
    this.theme();
  }

  theme(): void {
    this.scene.background = new Color(isDark() ? 0x12171d : 0xf8fafb);
    this.draw();
  }

  /** Look at a ball from a direction. */
  look(centre: Vector3, radius: number, from: Vector3): void {
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(from.normalize(), radius * 3.9);
    this.camera.near = radius / 50;
    this.camera.far = radius * 40;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  /** Turn to another side, upright and smoothly; at once where less motion is asked for. */
  glide(from: Vector3): void {
    const centre = this.controls.target, away = this.camera.position.clone().sub(centre);
    const start = spherical(away), end = spherical(from.clone().setLength(away.length()));
    const turn = Math.atan2(Math.sin(end.theta - start.theta), Math.cos(end.theta - start.theta));
    const began = performance.now(), takes = matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : GLIDE_MS;
    const number = ++this.gliding;
    const step = (): void => {
      if (number !== this.gliding) return;
      const share = takes ? Math.min(1, (performance.now() - began) / takes) : 1, eased = share * share * (3 - 2 * share);
      const at = new Spherical(start.radius, start.phi + eased * (end.phi - start.phi), start.theta + eased * turn).makeSafe();
      this.camera.position.copy(centre).add(cartesian(at));
      this.controls.update();
      this.draw();
      if (share < 1) requestAnimationFrame(step);
    };
    step();
  }

  get target(): Vector3 { return this.controls.target; }

  /** Draw once, with the next picture of the screen. */
  draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const { clientWidth: w, clientHeight: h } = this.canvas;
      if (!w || !h) return;
      const aspect = w / h;
      this.renderer.setSize(w, h, false);
      if (this.camera.aspect !== aspect) {
        this.camera.aspect = aspect;
        this.camera.fov = (360 / Math.PI) * Math.atan(FIELD * Math.max(1, NARROW / aspect));
        this.camera.updateProjectionMatrix();
      }
      this.renderer.render(this.scene, this.camera);
    });
  }

  private key(event: KeyboardEvent): void {
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP],
    };
    const turn = turns[event.key];
    const nearer = event.key === "+" || event.key === "=" ? 0.88 : event.key === "-" ? 1 / 0.88 : 1;
    if (!turn && nearer === 1) return;
    event.preventDefault();
    const away = this.camera.position.clone().sub(this.controls.target);
    const at = spherical(away);
    this.gliding++;
    at.theta += turn?.[0] ?? 0;
    at.phi += turn?.[1] ?? 0;
    at.radius *= nearer;
    at.makeSafe();
    this.camera.position.copy(this.controls.target).add(cartesian(at));
    this.controls.update();
    this.draw();
  }
}

/** Of a vector; three's spherical coordinates have y up, the bench z. */
function spherical(away: Vector3): Spherical {
  return new Spherical().setFromVector3(new Vector3(away.x, away.z, -away.y));
}

function cartesian(at: Spherical): Vector3 {
  const to = new Vector3().setFromSpherical(at);
  return new Vector3(to.x, -to.z, to.y);
}
